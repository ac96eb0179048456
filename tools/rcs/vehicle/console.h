#pragma once
// Lines on stderr from a program that must not be blocked by a slow reader.

#include <cstdint>
#include <string_view>

namespace rcs::cli {

/// A line that does not fit (a terminal stopped by Ctrl-S, a reader that hangs) is dropped; the
/// next line that fits is preceded by the number of dropped lines.
class Console {
 public:
  void line(std::string_view prefix, std::string_view text);

 private:
  std::int64_t left_out_ = 0;
};

}  // namespace rcs::cli

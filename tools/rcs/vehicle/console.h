#pragma once
// Lines on stderr from a program that must not be held up by whoever reads them.

#include <cstdint>
#include <string_view>

namespace rcs::cli {

/// A line that does not fit (a terminal stopped by Ctrl-S, a reader that hangs) is left out, and
/// the next one that fits says how many were.
class Console {
 public:
  void line(std::string_view prefix, std::string_view text);

 private:
  std::int64_t left_out_ = 0;
};

}  // namespace rcs::cli

#pragma once
// Output of a process that runs live: nothing that it prints may block it.

#include <cstdint>
#include <string>
#include <string_view>

namespace rcs {

/// Writes to stderr what it takes now: a terminal may take a part.
/// @return something was written
bool write_without_waiting(std::string_view text);

/// Prints lines to stderr. A line for which there is no room now, as with a full pipe or a stopped
/// terminal, is dropped; the next one says how many were.
class TerminalLines {
 public:
  void print(std::string_view line) { print("", line); }
  void print(std::string_view prefix, std::string_view line);

 private:
  std::int64_t dropped_ = 0;
  std::string text_;
};

}  // namespace rcs

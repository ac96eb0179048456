#pragma once
// What a supervising command prints, so that it never blocks.

#include <string_view>

#include "rcs/node/process/terminal_line.h"

namespace rcs::cli {

class Console {
 public:
  void line(std::string_view prefix, std::string_view text);
  /// On a terminal a line that the next one replaces; elsewhere nothing.
  void status(std::string_view text);

 private:
  TerminalLines lines_;
  bool shows_status_ = false;
};

}  // namespace rcs::cli

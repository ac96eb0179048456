#include "tools/rcs/vehicle/console.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <string>

namespace rcs::cli {

void Console::line(std::string_view prefix, std::string_view text) {
  pollfd stream{STDERR_FILENO, POLLOUT, 0};
  if (poll(&stream, 1, 0) != 1 || (stream.revents & POLLOUT) == 0) {
    ++left_out_;
    return;
  }
  std::string out;
  if (left_out_ > 0) out = fmt::format("({} lines dropped: stderr was blocked)\n", left_out_);
  left_out_ = 0;
  out += fmt::format("{}{}\n", prefix, text);
  if (write(STDERR_FILENO, out.data(), out.size()) < 0) ++left_out_;
}

}  // namespace rcs::cli

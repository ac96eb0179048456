#include "rcs/node/process/terminal_line.h"

#include <fmt/format.h>
#include <limits.h>
#include <poll.h>
#include <unistd.h>

#include <iterator>

namespace rcs {

void TerminalLines::print(std::string_view prefix, std::string_view line) {
  pollfd stream{STDERR_FILENO, POLLOUT, 0};
  const bool ready = poll(&stream, 1, 0) == 1 && (stream.revents & POLLOUT) != 0;
  // A pipe without a reader is "ready", and SIGPIPE would end the process.
  if (!ready || (stream.revents & (POLLERR | POLLHUP)) != 0) {
    ++dropped_;
    return;
  }
  text_.clear();
  const auto out = std::back_inserter(text_);
  if (dropped_ > 0) fmt::format_to(out, "({} lines dropped: stderr was blocked)\n", dropped_);
  fmt::format_to(out, "{}{}\n", prefix, line);
  // A pipe that is ready has room for this many bytes; more could block.
  if (text_.size() > PIPE_BUF) {
    text_.resize(PIPE_BUF);
    text_.back() = '\n';
  }
  const bool printed = write(STDERR_FILENO, text_.data(), text_.size()) >= 0;
  dropped_ = printed ? 0 : dropped_ + 1;
}

}  // namespace rcs

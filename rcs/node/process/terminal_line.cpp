#include "rcs/node/process/terminal_line.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <limits.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <iterator>

#include "rcs/base/file_handle.h"

namespace rcs {

// stderr is shared with other processes and must not be set to O_NONBLOCK: a terminal or pipe is
// opened again for it, a socket (journald) needs no mode.
bool write_without_waiting(std::string_view text) {
  struct stat stream {};
  if (fstat(STDERR_FILENO, &stream) != 0) return false;
  if (S_ISSOCK(stream.st_mode)) {
    return send(STDERR_FILENO, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL) > 0;
  }
  const bool may_block = S_ISCHR(stream.st_mode) || S_ISFIFO(stream.st_mode);
  if (!may_block) return ::write(STDERR_FILENO, text.data(), text.size()) > 0;
  pollfd ready{STDERR_FILENO, POLLOUT, 0};
  if (poll(&ready, 1, 0) != 1 || (ready.revents & POLLOUT) == 0) return false;
  // A pipe without a reader is "ready", and SIGPIPE would end the process.
  if ((ready.revents & (POLLERR | POLLHUP)) != 0) return false;
  const FileHandle again(
      ::open("/proc/self/fd/2", O_WRONLY | O_NONBLOCK | O_NOCTTY | O_APPEND | O_CLOEXEC));
  // A terminal of another user cannot be opened: what is ready may block for a line in part.
  return ::write(again.valid() ? again.get() : STDERR_FILENO, text.data(), text.size()) > 0;
}

void TerminalLines::print(std::string_view prefix, std::string_view line) {
  text_.clear();
  const auto out = std::back_inserter(text_);
  if (dropped_ > 0) fmt::format_to(out, "({} lines dropped: stderr was blocked)\n", dropped_);
  fmt::format_to(out, "{}{}\n", prefix, line);
  // A pipe that is ready has room for this many bytes at once.
  if (text_.size() > PIPE_BUF) {
    text_.resize(PIPE_BUF);
    text_.back() = '\n';
  }
  dropped_ = write_without_waiting(text_) ? 0 : dropped_ + 1;
}

}  // namespace rcs

#include "tools/rcs/standard_streams.h"

#include <fcntl.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <ctime>
#include <new>
#include <string>
#include <string_view>

#include "rcs/base/printable.h"

namespace rcs::cli {
namespace {

/// Writes as much as possible. SIGPIPE, of a reader that has ended, is discarded.
void write_without_signal(int fd, std::string_view text) {
  sigset_t pipe;
  sigset_t before;
  sigemptyset(&pipe);
  sigaddset(&pipe, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &pipe, &before);
  while (!text.empty()) {
    const ssize_t n = ::write(fd, text.data(), text.size());
    if (n <= 0) break;
    text.remove_prefix(static_cast<std::size_t>(n));
  }
  const timespec no_wait{};
  (void)sigtimedwait(&pipe, nullptr, &no_wait);
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

ssize_t write_message(void* /*cookie*/, const char* data, std::size_t size) {
  write_without_signal(STDERR_FILENO, printable({data, size}));
  return static_cast<ssize_t>(size);
}

}  // namespace

void open_standard_streams() {
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(fd, F_GETFD) != -1) continue;
    // The lowest free number is fd, because those below are open.
    (void)::open("/dev/null", fd == STDERR_FILENO ? O_WRONLY : O_RDONLY);
  }
}

void protect_messages() {
  std::FILE* const messages =
      ::fopencookie(nullptr, "w", {nullptr, write_message, nullptr, nullptr});
  if (messages == nullptr) throw std::bad_alloc();
  (void)std::setvbuf(messages, nullptr, _IONBF, 0);
  stderr = messages;
}

void replace_line(std::string_view text) {
  write_without_signal(STDERR_FILENO, "\r\033[K" + printable(text));
}

}  // namespace rcs::cli

#include "tools/rcs/vehicle/console.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <string>

namespace rcs::cli {
namespace {

constexpr std::string_view kEraseLine = "\r\033[K";

bool accepts_text() {
  pollfd stream{STDERR_FILENO, POLLOUT, 0};
  return poll(&stream, 1, 0) == 1 && (stream.revents & POLLOUT) != 0;
}

}  // namespace

void Console::line(std::string_view prefix, std::string_view text) {
  if (!accepts_text()) {
    ++left_out_;
    return;
  }
  std::string out;
  if (shows_status_) out = kEraseLine;
  if (left_out_ > 0) out += fmt::format("({} lines dropped: stderr was blocked)\n", left_out_);
  left_out_ = 0;
  shows_status_ = false;
  out += fmt::format("{}{}\n", prefix, text);
  if (write(STDERR_FILENO, out.data(), out.size()) < 0) ++left_out_;
}

void Console::status(std::string_view text) {
  if (isatty(STDERR_FILENO) == 0 || !accepts_text()) return;
  const std::string out = fmt::format("{}{}", kEraseLine, text);
  shows_status_ = write(STDERR_FILENO, out.data(), out.size()) >= 0;
}

}  // namespace rcs::cli

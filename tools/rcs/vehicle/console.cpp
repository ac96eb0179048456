#include "tools/rcs/vehicle/console.h"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <string>

namespace rcs::cli {
namespace {

constexpr std::string_view kEraseLine = "\r\033[K";

}  // namespace

void Console::line(std::string_view prefix, std::string_view text) {
  lines_.print(fmt::format("{}{}", shows_status_ ? kEraseLine : "", prefix), text);
  shows_status_ = false;
}

void Console::status(std::string_view text) {
  pollfd stream{STDERR_FILENO, POLLOUT, 0};
  if (isatty(STDERR_FILENO) == 0 || poll(&stream, 1, 0) != 1) return;
  const std::string out = fmt::format("{}{}", kEraseLine, text);
  shows_status_ = write(STDERR_FILENO, out.data(), out.size()) >= 0;
}

}  // namespace rcs::cli

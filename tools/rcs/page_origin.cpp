#include "tools/rcs/page_origin.h"

#include <fmt/format.h>

#include "rcs/node/time_text.h"
#include "rcs/node/timeline/live_timeline.h"

namespace rcs::cli {
namespace {

std::string& command_line() {
  static std::string line;
  return line;
}

}  // namespace

std::string shell_word(const std::string& word) {
  const bool plain = !word.empty() && word.find_first_not_of(
                                          "abcdefghijklmnopqrstuvwxyz"
                                          "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                          "0123456789_-./=:,@%+") == std::string::npos;
  if (plain) return word;
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

void note_command_line(int argc, char** argv) {
  command_line() = "rcs";
  for (int i = 1; i < argc; ++i) command_line() += " " + shell_word(argv[i]);
}

report::PageOrigin page_origin(const std::string& configuration) {
  const std::int64_t now = wall_utime();
  return {command_line(), configuration, "rcs " RCS_VERSION,
          fmt::format("{} {} UTC", utc_date(now), time_of_day(now).substr(0, 5))};
}

}  // namespace rcs::cli

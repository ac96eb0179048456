#include "rcs/node/time_text.h"

#include <fmt/format.h>
#include <time.h>

namespace rcs {
namespace {

constexpr std::int64_t kDay_ms = 86'400'000;

std::int64_t floor_div(std::int64_t a, std::int64_t b) { return a / b - (a % b < 0 ? 1 : 0); }

}  // namespace

std::string time_of_day(std::int64_t utime) {
  const std::int64_t ms = floor_div(utime, 1000);
  const std::int64_t of_day = ms - kDay_ms * floor_div(ms, kDay_ms);
  return fmt::format("{:02}:{:02}:{:02}.{:03}", of_day / 3'600'000, of_day / 60'000 % 60,
                     of_day / 1000 % 60, of_day % 1000);
}

std::string utc_date(std::int64_t utime) {
  const auto s = static_cast<time_t>(floor_div(utime, 1'000'000));
  tm date{};
  if (gmtime_r(&s, &date) == nullptr) return "?";  // a year that does not fit
  return fmt::format("{:04}-{:02}-{:02}", date.tm_year + 1900, date.tm_mon + 1, date.tm_mday);
}

}  // namespace rcs

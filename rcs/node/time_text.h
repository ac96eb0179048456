#pragma once
// Times of the UTC epoch for people.

#include <cstdint>
#include <string>

namespace rcs {

/// Time of day in UTC, "12:34:56.789". @param utime  since 1970, in microseconds
[[nodiscard]] std::string time_of_day(std::int64_t utime);

/// "2026-11-24"
[[nodiscard]] std::string utc_date(std::int64_t utime);

}  // namespace rcs

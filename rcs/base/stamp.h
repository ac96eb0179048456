#pragma once
// Points in time and durations. One clock type for the whole system, so that a time point of
// another clock does not convert to it. Sensor time and node time share this type and must not be
// subtracted from one another.

#include <chrono>
#include <cstdint>
#include <optional>

namespace rcs {

/// The time base of one vehicle (or log, or simulation). It has no now(): only a Timeline provides
/// the current time, so that a node runs live exactly as in a replay.
struct VehicleClock {
  using duration = std::chrono::microseconds;
  using rep = duration::rep;
  using period = duration::period;
  using time_point = std::chrono::time_point<VehicleClock, duration>;
  static constexpr bool is_steady = false;
};

using Duration = VehicleClock::duration;
using Stamp = VehicleClock::time_point;

/// LCM's `utime`: int64 microseconds.
constexpr Stamp from_utime(std::int64_t utime) { return Stamp(Duration(utime)); }
constexpr std::int64_t to_utime(Stamp stamp) { return stamp.time_since_epoch().count(); }

constexpr double seconds(Duration d) { return static_cast<double>(d.count()) * 1e-6; }
constexpr double milliseconds(Duration d) { return static_cast<double>(d.count()) * 1e-3; }

/// The largest duration of a number: 36,000 years. Sums of a few of them cannot overflow.
constexpr Duration kMaxDuration{std::int64_t{1} << 60};

/// Rounds to the nearest microsecond (half away from zero). Limited to +-kMaxDuration; NaN gives
/// kMaxDuration. For untrusted input use checked_seconds().
constexpr Duration from_seconds(double s) {
  const double us = s * 1e6 + (s < 0.0 ? -0.5 : 0.5);
  constexpr auto kMax_us = static_cast<double>(kMaxDuration.count());
  if (us <= -kMax_us) return -kMaxDuration;
  return us < kMax_us ? Duration(static_cast<std::int64_t>(us)) : kMaxDuration;
}
constexpr Duration from_milliseconds(double ms) { return from_seconds(ms * 1e-3); }

/// Seconds from a file or a command line; nullopt if they are NaN or beyond kMaxDuration.
constexpr std::optional<Duration> checked_seconds(double s) {
  const Duration d = from_seconds(s);
  return d > -kMaxDuration && d < kMaxDuration ? std::optional(d) : std::nullopt;
}

}  // namespace rcs

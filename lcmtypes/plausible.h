#pragma once
// Conditions under which a received message is accepted, for all readers: numbers are finite and
// within what a vehicle can reach, stamps have sums and differences that do not overflow. A message
// is untrusted input.

#include <cstdint>

#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/base/pose.h"

namespace rcs {

[[nodiscard]] inline bool plausible_stamp(std::int64_t utime) {
  constexpr std::int64_t kCenturies = 10'000'000'000'000'000;
  return utime > -kCenturies && utime < kCenturies;
}

/// Each component is finite and its absolute value at most `limit`.
[[nodiscard]] inline bool within(const Vec3& v, double limit) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= limit;
}

constexpr double kFarthest_m = 1e7;  ///< of any point from the origin of its frame
constexpr double kFastest_mps = 200.0;
constexpr double kFastest_radps = 35.0;
constexpr double kHardest_mps2 = 400.0;

[[nodiscard]] inline bool plausible(const ins_t& m) {
  const double dt_s = 1e-6 * m.interval_us;
  return m.valid == 1 && plausible_stamp(m.utime) && dt_s > 0.0 && dt_s <= 0.5 &&
         within(from_message(m.delta_angle_rad), kFastest_radps * dt_s) &&
         within(from_message(m.delta_v_mps), kHardest_mps2 * dt_s);
}

/// Checks stamp and motion. The pose and the covariance are checked where they are used
/// (from_message).
[[nodiscard]] inline bool plausible_motion(const nav_state_t& m) {
  return plausible_stamp(m.utime) && within(from_message(m.p_world_vehicle_m), kFarthest_m) &&
         within(from_message(m.p_local_vehicle_m), kFarthest_m) &&
         within(from_message(m.p_rolling_vehicle_m), kFarthest_m) &&
         within(from_message(m.v_world_mps), kFastest_mps) &&
         within(from_message(m.rate_vehicle_radps), kFastest_radps) &&
         within(from_message(m.gyro_bias_radps), kFastest_radps) &&
         within(from_message(m.accel_bias_mps2), kHardest_mps2);
}

}  // namespace rcs

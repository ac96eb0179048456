#include "rcs/ros2/sensor_messages.h"

#include <cmath>
#include <limits>

#include "lcmtypes/convert.h"
#include "lcmtypes/plausible.h"

namespace rcs::ros2 {
namespace {

std::int8_t status_of(int fix_type) {
  enum : std::int8_t { kNoFix = -1, kFix = 0, kSbas = 1, kGbas = 2 };
  switch (fix_type) {
    case gps_fix_t::FIX_SINGLE:
      return kFix;
    case gps_fix_t::FIX_DIFFERENTIAL:
      return kSbas;
    case gps_fix_t::FIX_FLOAT:
    case gps_fix_t::FIX_FIXED:
      return kGbas;
    default:
      return kNoFix;
  }
}

}  // namespace

std::optional<msg::NavSatFix> to_nav_sat_fix(const gps_fix_t& m, const ClockOffsets& clocks) {
  if (!std::isfinite(m.lat_deg) || !std::isfinite(m.lon_deg) || !std::isfinite(m.height_m)) {
    return std::nullopt;
  }
  constexpr std::uint16_t kServiceGps = 1;
  constexpr std::uint8_t kDiagonalKnown = 2;
  msg::NavSatFix out;
  out.header = {to_time(shifted(m.utime, clocks.sensor_us)), kGpsFrame};
  out.status = {status_of(m.fix_type), kServiceGps};
  out.latitude = m.lat_deg;
  out.longitude = m.lon_deg;
  // A NaN undulation makes the altitude NaN, which is "not available" in ROS 2.
  out.altitude =
      m.height_kind == gps_fix_t::HEIGHT_ELLIPSOIDAL ? m.height_m : m.height_m + m.undulation_m;
  const bool known = within(from_message(m.sigma_enu_m), kFarthest_m) && m.sigma_enu_m[0] > 0.0 &&
                     m.sigma_enu_m[1] > 0.0 && m.sigma_enu_m[2] > 0.0;
  if (known) {
    out.position_covariance_type = kDiagonalKnown;
    for (std::size_t i = 0; i < 3; ++i) {
      out.position_covariance[4 * i] = m.sigma_enu_m[i] * m.sigma_enu_m[i];
    }
  }
  return out;
}

std::optional<msg::Imu> to_imu(const ins_t& m, const ClockOffsets& clocks) {
  if (!plausible(m)) return std::nullopt;
  const double dt_s = 1e-6 * m.interval_us;
  msg::Imu out;
  out.header = {to_time(shifted(m.utime, clocks.sensor_us)), kBaseFrame};
  out.orientation_covariance[0] = -1.0;
  out.angular_velocity = to_vector3(from_message(m.delta_angle_rad) / dt_s);
  out.linear_acceleration = to_vector3(from_message(m.delta_v_mps) / dt_s);
  return out;
}

std::optional<msg::TwistWithCovarianceStamped> to_twist(const odometry_t& m,
                                                        const ClockOffsets& clocks) {
  if (!std::isfinite(m.speed_mps)) return std::nullopt;
  const auto variance = [](double sigma) {
    return std::isfinite(sigma) && sigma > 0.0 ? sigma * sigma : kUnknownVariance;
  };
  msg::TwistWithCovarianceStamped out;
  out.header = {to_time(shifted(m.utime, clocks.sensor_us)), kBaseFrame};
  for (std::size_t i = 0; i < 6; ++i) out.twist.covariance[7 * i] = kUnknownVariance;
  out.twist.twist.linear.x = m.speed_mps;
  out.twist.covariance[0] = variance(m.sigma_speed_mps);
  if (std::isfinite(m.yaw_rate_radps)) {
    out.twist.twist.angular.z = m.yaw_rate_radps;
    out.twist.covariance[35] = variance(m.sigma_yaw_rate_radps);
  }
  return out;
}

}  // namespace rcs::ros2

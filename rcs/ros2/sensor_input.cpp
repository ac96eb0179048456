#include "rcs/ros2/sensor_input.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "lcmtypes/convert.h"
#include "lcmtypes/plausible.h"
#include "rcs/base/check.h"
#include "rcs/ros2/frames.h"

namespace rcs::ros2 {
namespace {

Vec3 from_vector3(const msg::Vector3& v) { return {v.x, v.y, v.z}; }

/// Standard deviation of a variance of ROS 2; nullopt: unknown (0, not finite, or "very large").
std::optional<double> sigma_of(double variance) {
  if (!(variance > 0.0 && variance < kUnknownVariance)) return std::nullopt;
  return std::sqrt(variance);
}

std::int8_t fix_type_of(std::int8_t status) {
  switch (status) {
    case 0:
      return gps_fix_t::FIX_SINGLE;
    case 1:
      return gps_fix_t::FIX_DIFFERENTIAL;
    case 2:
      return gps_fix_t::FIX_FLOAT;
    default:
      return gps_fix_t::FIX_NONE;
  }
}

}  // namespace

std::optional<std::int64_t> utc_of(const msg::Time& stamp) {
  constexpr std::uint32_t kSecond_ns = 1'000'000'000;
  if (stamp.sec < 0 || stamp.nanosec >= kSecond_ns) return std::nullopt;
  return std::int64_t{stamp.sec} * 1'000'000 + stamp.nanosec / 1000;
}

std::optional<ins_t> to_ins(const msg::Imu& m, std::int64_t utime, Duration interval,
                            const Quat& q_vehicle_imu) {
  constexpr Duration kLongest = from_seconds(0.5);
  if (interval <= Duration::zero() || interval > kLongest) return std::nullopt;
  const double dt_s = seconds(interval);
  ins_t out{};
  out.utime = utime;
  out.interval_us = static_cast<std::int32_t>(interval.count());
  to_message(Vec3(dt_s * (q_vehicle_imu * from_vector3(m.angular_velocity))), out.delta_angle_rad);
  to_message(Vec3(dt_s * (q_vehicle_imu * from_vector3(m.linear_acceleration))), out.delta_v_mps);
  out.valid = 1;
  if (!plausible(out)) return std::nullopt;
  return out;
}

std::optional<gps_fix_t> to_gps_fix(const msg::NavSatFix& m, std::int64_t utime,
                                    const Vec3& default_sigma_m) {
  gps_fix_t out{};
  out.utime = utime;
  out.height_kind = gps_fix_t::HEIGHT_ELLIPSOIDAL;
  out.undulation_m = std::numeric_limits<double>::quiet_NaN();
  out.fix_type = fix_type_of(m.status.status);
  if (out.fix_type == gps_fix_t::FIX_NONE) return out;
  constexpr double kHighest_m = 1e5;
  const bool good = std::abs(m.latitude) <= 90.0 && std::abs(m.longitude) <= 180.0 &&
                    std::abs(m.altitude) <= kHighest_m;  // false for NaN
  if (!good) return std::nullopt;
  out.lat_deg = m.latitude;
  out.lon_deg = m.longitude;
  out.height_m = m.altitude;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::optional<double> known =
        m.position_covariance_type == 0 ? std::nullopt : sigma_of(m.position_covariance[4 * i]);
    out.sigma_enu_m[i] = known.value_or(default_sigma_m[static_cast<Eigen::Index>(i)]);
  }
  return out;
}

std::optional<odometry_t> to_odometry(const msg::Odometry& m, std::int64_t utime,
                                      std::optional<Duration> interval, double default_sigma_mps) {
  constexpr Duration kLongest = from_seconds(1.0);
  const double speed_mps = m.twist.twist.linear.x;
  const double yaw_rate_radps = m.twist.twist.angular.z;
  if (!(std::abs(speed_mps) <= kFastest_mps)) return std::nullopt;
  odometry_t out{};
  out.utime = utime;
  if (interval && *interval > Duration::zero() && *interval <= kLongest) {
    out.interval_us = static_cast<std::int32_t>(interval->count());
  }
  out.speed_mps = speed_mps;
  out.sigma_speed_mps = sigma_of(m.twist.covariance[0]).value_or(default_sigma_mps);
  const std::optional<double> sigma_yaw = sigma_of(m.twist.covariance[35]);
  const bool turns = sigma_yaw && std::abs(yaw_rate_radps) <= kFastest_radps;
  out.yaw_rate_radps = turns ? yaw_rate_radps : std::numeric_limits<double>::quiet_NaN();
  out.sigma_yaw_rate_radps = turns ? *sigma_yaw : 0.0;
  return out;
}

void to_facets(const CloudPoints& points, std::int64_t utime, std::int64_t scan_id,
               std::int16_t sensor_id, std::vector<ladar_points_t>* out) {
  const std::size_t n = points.x_m.size();
  const bool timed = !points.dt_us.empty();
  RCS_CHECK(n > 0 && (!timed || points.dt_us.size() == n));
  std::vector<std::uint32_t> order(n);
  std::iota(order.begin(), order.end(), 0U);
  if (timed) {
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      return std::pair(points.dt_us[a], a) < std::pair(points.dt_us[b], b);
    });
  }
  const auto after_us = [&](std::size_t i) {
    return timed ? std::int64_t{points.dt_us[order[i]]} : std::int64_t{0};
  };
  const std::size_t count = (n + kMaxFacetPoints - 1) / kMaxFacetPoints;
  out->resize(count);
  for (std::size_t facet = 0; facet < count; ++facet) {
    const std::size_t begin = facet * kMaxFacetPoints;
    const std::size_t end = std::min(begin + kMaxFacetPoints, n);
    ladar_points_t& m = (*out)[facet];
    m.utime = utime + after_us(begin);
    m.sensor_id = sensor_id;
    m.scan_id = scan_id;
    m.reference_utime = utime + after_us(n - 1);
    m.facet = static_cast<std::int16_t>(facet);
    m.facet_count = static_cast<std::int16_t>(count);
    m.rows = m.cols = 0;
    m.n = static_cast<std::int32_t>(end - begin);
    m.n_index = 0;
    m.n_time = timed ? m.n : 0;
    for (std::vector<float>* axis : {&m.x_m, &m.y_m, &m.z_m}) axis->clear();
    m.row.clear();
    m.col.clear();
    m.dt_us.clear();
    for (std::size_t i = begin; i < end; ++i) {
      m.x_m.push_back(points.x_m[order[i]]);
      m.y_m.push_back(points.y_m[order[i]]);
      m.z_m.push_back(points.z_m[order[i]]);
      if (timed) m.dt_us.push_back(static_cast<std::int32_t>(after_us(i) - after_us(begin)));
    }
  }
}

}  // namespace rcs::ros2

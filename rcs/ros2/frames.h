#pragma once
// Frames, times and poses of ROS 2 (REP 103, REP 105).

#include <array>
#include <cstdint>
#include <string>

#include "rcs/base/pose.h"
#include "rcs/ros2/basic_types.h"

namespace rcs::ros2 {

/// Our frames by the names of REP 105.
inline constexpr char kMapFrame[] = "map";          ///< world
inline constexpr char kOdomFrame[] = "odom";        ///< local
inline constexpr char kRollingFrame[] = "rolling";  ///< rolling; not in REP 105
inline constexpr char kBaseFrame[] = "base_link";   ///< vehicle
inline constexpr char kLadarFrame[] = "ladar";      ///< ladar
inline constexpr char kGpsFrame[] = "gps";          ///< antenna

/// Variance of a component of a twist that nothing measures, [(m/s)^2] or [(rad/s)^2]. ROS 2 has no
/// value for it; 0 would be certainty.
inline constexpr double kUnknownVariance = 1e6;

/// The time of one log. Messages have the time of the sensors or of the nodes, and MCAP the time at
/// which they were recorded. One offset for each clock maps both to the time of the log, so that
/// all stamps in a file can be compared.
struct ClockOffsets {
  std::int64_t sensor_us = 0;  ///< to be added to sensor time
  std::int64_t node_us = 0;    ///< to be added to node time
};

/// @param utime  [us], limited to what the type can express (0 to the year 2038)
[[nodiscard]] msg::Time to_time(std::int64_t utime);
/// utime + offset, limited to the range of the type.
[[nodiscard]] std::int64_t shifted(std::int64_t utime, std::int64_t offset_us);

[[nodiscard]] msg::Pose to_pose(const Pose& T);
[[nodiscard]] msg::Vector3 to_vector3(const Vec3& v);
/// @return T_frame_child
[[nodiscard]] msg::TransformStamped to_transform(const msg::Time& stamp, const char* frame,
                                                 const char* child, const Pose& T);

/// Covariance of a pose as ROS 2 defines it. Ours is of a perturbation on the right,
/// T * exp(rho, phi), along the axes of the vehicle; that of ROS 2 is of the position and of a
/// rotation about the axes of the fixed frame. To first order dp = R rho and dtheta = R phi:
/// the result is diag(R, R) C diag(R, R)^T, row by row.
/// @param cov  of T_fixed_vehicle, (rho [m], phi [rad])
[[nodiscard]] std::array<double, 36> fixed_axes_covariance(const Pose& T, const Mat6& cov);

}  // namespace rcs::ros2

#pragma once
// Sensor messages of ROS 2 from untrusted publishers as sensor messages of this system: the inverse
// of sensor_messages.h. Each function returns nullopt for a message with a value that is not finite
// or that no vehicle can reach. Frames and stamps are checked by the caller.

#include <cstdint>
#include <optional>
#include <vector>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "rcs/base/pose.h"
#include "rcs/ros2/cloud_reader.h"
#include "rcs/ros2/nav_types.h"

namespace rcs::ros2 {

/// [us] since 1970; nullopt: before 1970, or 10^9 or more nanoseconds.
[[nodiscard]] std::optional<std::int64_t> utc_of(const msg::Time& stamp);

/// The angular rate and the specific force of the message over the interval that it ends.
/// @param utime      sensor time of the message
/// @param interval   since the message before
/// @param q_vehicle_imu  rotation from the axes of the IMU to those of the vehicle
[[nodiscard]] std::optional<ins_t> to_ins(const msg::Imu& m, std::int64_t utime, Duration interval,
                                          const Quat& q_vehicle_imu);

/// A message without a fix has FIX_NONE and no position. GBAS becomes FIX_FLOAT, because ROS 2 does
/// not state whether the ambiguities are fixed. The altitude must be known.
/// @param default_sigma_m  east, north, up; where the covariance is unknown
[[nodiscard]] std::optional<gps_fix_t> to_gps_fix(const msg::NavSatFix& m, std::int64_t utime,
                                                  const Vec3& default_sigma_m);

/// The twist of the message along x and about z of its child frame; its pose is not used, because
/// WM integrates the speed itself. A yaw rate without a variance is unknown.
/// @param interval  since the message before; longer than 1 s or none: the speed is that of `utime`
/// @param default_sigma_mps  where the variance of the speed is unknown
[[nodiscard]] std::optional<odometry_t> to_odometry(const msg::Odometry& m, std::int64_t utime,
                                                    std::optional<Duration> interval,
                                                    double default_sigma_mps);

/// Largest number of points of a facet: a message has at most 60 kB.
inline constexpr std::size_t kMaxFacetPoints = 3500;

/// The points of a cloud as the facets of one scan, in the order of their times. The reference
/// instant is the last point, or the stamp for a cloud without times of points.
/// @param utime  sensor time of the stamp of the cloud
/// @param out    replaced; the buffers of its messages are reused
void to_facets(const CloudPoints& points, std::int64_t utime, std::int64_t scan_id,
               std::int16_t sensor_id, std::vector<ladar_points_t>* out);

}  // namespace rcs::ros2

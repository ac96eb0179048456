#pragma once
// Messages of WM and BG about poses as messages of ROS 2. Each function returns nullopt for a
// message that states an invalid pose or has a number that is not finite.

#include <optional>

#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "rcs/ros2/frames.h"
#include "rcs/ros2/nav_types.h"
#include "rcs/ros2/status_types.h"

namespace rcs::ros2 {

struct NavMessages {
  msg::PoseWithCovarianceStamped pose;  ///< T_map_base_link
  /// Pose in `map` with its covariance; the twist in `base_link` (rotation rates have
  /// kUnknownVariance, because WM publishes none).
  msg::Odometry odometry;
  /// map -> odom -> base_link, odom -> rolling if there is a rolling map, and base_link -> ladar if
  /// the mount is known. A transform that does not change is repeated: a viewer that seeks has it.
  msg::TfMessage tf;
};
/// @param T_vehicle_ladar  mount of the LADAR; nullopt: unknown
[[nodiscard]] std::optional<NavMessages> to_nav(const nav_state_t& m, const ClockOffsets& clocks,
                                                const std::optional<Pose>& T_vehicle_ladar);

/// The path that BG follows, in frame `odom`. Planned arrivals are the stamps of its poses.
[[nodiscard]] std::optional<msg::Path> to_path(const plan_t& m, const ClockOffsets& clocks);

/// Bounds of the position in frame `map`: in blue the ellipsoid of 3 sigma of the covariance (ns
/// "3_sigma"), in orange the protection level, a cylinder of its horizontal radius and vertical
/// half height (ns "protection_level"). The two are different statements. A bound that does not
/// exist deletes its marker.
/// @param nav  the newest; its pose is the centre
[[nodiscard]] std::optional<msg::MarkerArray> to_bounds(const nav_state_t& nav,
                                                        const integrity_t& integrity,
                                                        const ClockOffsets& clocks);

}  // namespace rcs::ros2

#pragma once
// Sensor messages as messages of ROS 2. Each function returns nullopt for a message that states
// invalid data or has a number that is not finite.

#include <optional>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "rcs/ros2/frames.h"
#include "rcs/ros2/sensor_types.h"

namespace rcs::ros2 {

/// The altitude is ellipsoidal, as ROS 2 defines it; NaN if the fix is orthometric and without an
/// undulation.
[[nodiscard]] std::optional<msg::NavSatFix> to_nav_sat_fix(const gps_fix_t& m,
                                                           const ClockOffsets& clocks);

/// Increments over their interval: mean angular rate and mean specific force, stamped with the end
/// of the interval. Without an orientation.
[[nodiscard]] std::optional<msg::Imu> to_imu(const ins_t& m, const ClockOffsets& clocks);

/// Along x and about z of `base_link`; other components have kUnknownVariance.
[[nodiscard]] std::optional<msg::TwistWithCovarianceStamped> to_twist(const odometry_t& m,
                                                                      const ClockOffsets& clocks);

}  // namespace rcs::ros2

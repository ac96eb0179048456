#pragma once
// Paths of the vehicle in the plane.

#include <cmath>
#include <limits>
#include <vector>

#include "modules/vj/traversal_cost.h"
#include "rcs/base/linear.h"

namespace rcs::bg {

/// Pose and steering curvature of the vehicle in the plane; the reference point is the origin of
/// the vehicle frame.
struct Pose2d {
  double x_m = 0.0;
  double y_m = 0.0;
  double heading_rad = 0.0;    ///< counter-clockwise from the frame's x
  double curvature_1pm = 0.0;  ///< positive left
};

/// `distance_m` farther along a circle with the curvature of `from`; negative: backwards.
[[nodiscard]] inline Pose2d along_arc(const Pose2d& from, double distance_m) {
  Pose2d to = from;
  to.heading_rad += from.curvature_1pm * distance_m;
  const double turn = 0.5 * from.curvature_1pm * distance_m;
  // The chord: sin(turn) / turn without the singularity.
  const double chord =
      distance_m * (std::abs(turn) < 1e-4 ? 1.0 - turn * turn / 6.0 : std::sin(turn) / turn);
  to.x_m += chord * std::cos(from.heading_rad + turn);
  to.y_m += chord * std::sin(from.heading_rad + turn);
  return to;
}

struct PathPoint {
  Pose2d place;
  int direction = 1;         ///< 1 ahead, -1 backwards
  double s_m = 0.0;          ///< distance driven since the start of the path
  double clearance_m = 0.0;  ///< from the vehicle's body to the nearest obstacle
  double limit_mps = 0.0;    ///< allowed by the ground, the turn and nearby obstacles
  double speed_mps = 0.0;    ///< planned: also limited by braking
  vj::SpeedCause cause = vj::SpeedCause::kTask;  ///< what limits speed_mps, here or farther on
  double zone_mps = std::numeric_limits<double>::infinity();  ///< limit of speed zones
  double road_mps = 0.0;  ///< speed of the road that the point certainly lies on; 0: none
};

using Path = std::vector<PathPoint>;

/// Outline and steering limits of the vehicle.
struct Shape {
  double length_m = 3.2;
  double width_m = 2.0;
  double max_curvature_1pm = 0.18;
  double curvature_rate = 0.2;  ///< steering rate [1/(m s)]
  double min_margin_m = 0.25;   ///< required distance from obstacles
};

}  // namespace rcs::bg

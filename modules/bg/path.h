#pragma once
// Ways of the vehicle, seen from above.

#include <cmath>
#include <vector>

#include "rcs/base/linear.h"

namespace rcs::bg {

/// Where the vehicle is and what its wheels do, seen from above; the reference point is the origin
/// of the vehicle frame.
struct Place {
  double x_m = 0.0;
  double y_m = 0.0;
  double heading_rad = 0.0;    ///< counter-clockwise from the frame's x
  double curvature_1pm = 0.0;  ///< positive left
};

/// `distance_m` further along a circle of the place's curvature; negative: backwards.
[[nodiscard]] inline Place along_arc(const Place& from, double distance_m) {
  Place to = from;
  to.heading_rad += from.curvature_1pm * distance_m;
  const double turn = 0.5 * from.curvature_1pm * distance_m;
  // The chord: sin(turn) / turn without the pole.
  const double chord =
      distance_m * (std::abs(turn) < 1e-4 ? 1.0 - turn * turn / 6.0 : std::sin(turn) / turn);
  to.x_m += chord * std::cos(from.heading_rad + turn);
  to.y_m += chord * std::sin(from.heading_rad + turn);
  return to;
}

struct PathPoint {
  Place place;
  int direction = 1;         ///< 1 ahead, -1 backwards
  double s_m = 0.0;          ///< driven since the path's start
  double clearance_m = 0.0;  ///< from the vehicle's body to the nearest obstacle
  double limit_mps = 0.0;    ///< of the ground, the turn and what is beside
  double speed_mps = 0.0;    ///< planned: also what the brakes allow
};

using Path = std::vector<PathPoint>;

/// The vehicle's outline and what it can do.
struct Shape {
  double length_m = 3.2;
  double width_m = 2.0;
  double max_curvature_1pm = 0.18;
  double curvature_rate = 0.2;  ///< how fast the wheels turn [1/(m s)]
  double margin_m = 0.4;        ///< obstacles are kept farther off than this
  double least_margin_m = 0.2;  ///< and than this where there is no other way
};

}  // namespace rcs::bg

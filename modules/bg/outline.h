#pragma once
// The ground under the vehicle.

#include <cmath>

#include "modules/bg/path.h"

namespace rcs::bg {

/// Calls what(x_m, y_m) for points under the outline of the vehicle, at most `step_m` apart.
template <class What>
void each_point_under(const Shape& shape, const Pose2d& place, double step_m, What&& what) {
  const double c = std::cos(place.heading_rad);
  const double s = std::sin(place.heading_rad);
  for (double ahead = -0.5 * shape.length_m; ahead <= 0.5 * shape.length_m; ahead += step_m) {
    for (double left = -0.5 * shape.width_m; left <= 0.5 * shape.width_m; left += step_m) {
      what(place.x_m + c * ahead - s * left, place.y_m + s * ahead + c * left);
    }
  }
}

}  // namespace rcs::bg

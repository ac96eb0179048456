#pragma once
// Roads and plains in the simulated world: where the relief has no bumps and nothing grows.

#include <vector>

#include "rcs/base/linear.h"

namespace rcs::sim {

struct Road {
  double width_m = 5.0;
  double shoulder_m = 4.0;  ///< on each side, over which the ground passes into the relief
  double finest_m = 40.0;   ///< spacing of the finest octave of the relief that remains on it
  std::vector<Vec2> points_world;  ///< at least two
};

/// Distance of a position from the surface of the nearest road [m]; on it negative; infinite
/// without roads.
[[nodiscard]] double distance_from_road(const std::vector<Road>& roads, double x_m, double y_m);

/// Share that the octaves keep that are finer than the road has: 0 on it, rising to 1 over the
/// shoulder.
[[nodiscard]] double relief_share(const Road& road, double x_m, double y_m);

}  // namespace rcs::sim

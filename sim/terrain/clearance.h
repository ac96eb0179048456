#pragma once
// Distance of the vehicle from obstacles: ground truth for the assessment of a drive.

#include "rcs/base/pose.h"
#include "sim/terrain/world.h"

namespace rcs::sim {

/// Outline of the vehicle in the plane: a rectangle around the origin of its frame.
struct Footprint {
  double length_m = 3.2;
  double width_m = 2.0;
};

struct Clearance {
  static constexpr double kFar_m = 1e3;

  /// From the rectangle to the nearest rock or trunk that rises more than 0.3 m above the bare
  /// ground; <= 0: a collision, this deep. kFar_m: nothing within 20 m.
  double hard_m = kFar_m;
  /// A bush or a crown overlaps the rectangle between 0.3 and 2.2 m above the bare ground.
  bool foliage = false;
};

/// In the plane: height and tilt of the vehicle are ignored, and so is the wind.
[[nodiscard]] Clearance clearance(const World& world, const Pose& T_world_vehicle,
                                  const Footprint& footprint);

}  // namespace rcs::sim

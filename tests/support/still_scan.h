#pragma once
// A scan of the simulated LADAR from a vehicle at rest.

#include <vector>

#include "modules/sp/scan/range_image.h"
#include "sim/sensors/ladar.h"
#include "sim/terrain/world.h"

namespace rcs::test {

/// Pose of a vehicle that stands on the ground, along its slope.
inline Pose T_world_standing(const sim::World& world, const Vec2& place_world, double heading_rad) {
  constexpr double kVehicleHeight_m = 0.9;
  const Vec3 up = world.normal(place_world.x(), place_world.y());
  const Quat level = Quat::FromTwoVectors(Vec3::UnitZ(), up);
  const double z = world.height(place_world.x(), place_world.y());
  return {level * exp_so3(Vec3(0.0, 0.0, heading_rad)),
          Vec3(place_world.x(), place_world.y(), z) + kVehicleHeight_m * up};
}

inline sim::Trajectory at_rest(const Pose& T_world_vehicle) {
  return {std::vector<Pose>(5, T_world_vehicle), 1.0};
}

/// One scan, with points computed from its ranges by `calibration`.
inline Points image_at_rest(const sim::World& world, const Pose& T_world_vehicle,
                            const sp::Calibration& calibration, sim::RangeImager* imager) {
  const sim::Trajectory still = at_rest(T_world_vehicle);
  sp::Scan scan;
  sim::RangeFacet facet;
  for (int f = 0; f < imager->params().facets; ++f) {
    imager->render(world, still, 0.0, f, &facet);
    sp::RangeFacet view;
    view.range_m = facet.range_m.data();
    view.first_row = facet.first_row;
    view.facet_rows = facet.range_m.empty() ? 0 : facet.rows;
    view.tilt_rad = facet.head.tilt_rad;
    calibration.append(view, &scan);
  }
  return scan.points;
}

}  // namespace rcs::test

#pragma once
// Contact of the vehicle with the ground beyond what it can drive over: ground truth for the
// assessment of a drive. Rocks and trunks are in clearance.h.

#include "rcs/base/pose.h"
#include "sim/terrain/clearance.h"
#include "sim/terrain/world.h"
#include "sim/vehicle/suspension.h"

namespace rcs::sim {

/// What the vehicle can drive over.
struct PassableLimits {
  double step_m = 0.35;    ///< edge under or at a wheel, up or down, within kEdge_m of it
  double belly_m = 0.40;   ///< ground under the body above the plane of the wheels
  double bumper_m = 0.45;  ///< the same in front of and behind the wheels
  double roll_rad = radians(30.0);
  double pitch_rad = radians(35.0);
};

/// Half of the length of ground across which an edge is a step and not a slope.
inline constexpr double kEdge_m = 0.15;

struct Contact {
  bool edge = false;    ///< a wheel at or over an edge: ledge, drop, ditch, wall
  bool body = false;    ///< the ground touches the body: high-centred, or driven against
  bool tipped = false;  ///< tilted beyond the limit
  [[nodiscard]] bool any() const { return edge || body || tipped; }
};

/// @param at  place and heading of the vehicle in the plane
/// @param T_world_vehicle  pose of the body
[[nodiscard]] Contact contact(const World& world, const CoursePoint& at,
                              const Pose& T_world_vehicle, const VehicleParams& vehicle,
                              const Footprint& footprint, const PassableLimits& limits);

}  // namespace rcs::sim

#pragma once
// Operating zones in frame local: forbidden ground is an obstacle of the terrain, and speed zones
// limit the speed along a path.

#include <cstdint>
#include <vector>

#include "modules/bg/body.h"
#include "modules/bg/path.h"
#include "modules/bg/remembered_ground.h"
#include "modules/bg/zone_guard.h"
#include "modules/vj/traversal_cost.h"
#include "rcs/zones/zone_raster.h"
#include "rcs/zones/zones.h"

namespace rcs::bg {

/// From frame world to frame local in the plane: both are upright.
struct LocalFromWorld {
  double yaw_rad = 0.0;
  Vec2 origin_m = Vec2::Zero();

  /// The transform that maps the same pose from the one frame to the other.
  [[nodiscard]] static LocalFromWorld between(const Pose2d& in_world, const Pose2d& in_local);
  [[nodiscard]] Pose2d to_world(const Pose2d& in_local) const;
};

/// Allocates nothing after a terrain as large.
class ZoneGround {
 public:
  /// Marks the cells of a terrain in frame local as obstacles whose centre has less clearance than
  /// the guard requires. For a vehicle that must leave forbidden ground, more is required at a
  /// distance from it, so that its path gains at least a quarter of its length in clearance.
  void mark(const Zones& zones, const LocalFromWorld& frame, const ZoneGuard& guard,
            const Pose2d& vehicle, vj::Terrain* terrain);

  /// Cells of the remembered ground, row by row, in which the centre of the vehicle would be nearer
  /// to forbidden ground than the guard requires. They are not remembered: the frames move relative
  /// to one another, and the level changes.
  /// @param body_m  radius around that centre
  const std::vector<std::uint8_t>& forbidden(const Zones& zones, const LocalFromWorld& frame,
                                             const ZoneGuard& guard, const RememberedGround& ground,
                                             double body_m);

 private:
  /// @param beyond_m  distance from the vehicle
  void mark(const Zones& zones, const ZoneWindow& window, double required_m, const Pose2d& vehicle,
            double beyond_m, vj::Terrain* terrain);

  ZoneRaster raster_;
  ZoneRaster far_raster_;
};

/// Smallest clearance of the outline of the vehicle, by the discs of its body.
[[nodiscard]] inline double zone_clearance(const Zones& zones, const Body& body,
                                           const Pose2d& in_world) {
  return body.clearance_by(
      [&](double x_m, double y_m) { return zones.clearance(Vec2(x_m, y_m)).m; }, in_world);
}

/// Sets PathPoint::zone_mps and road_mps of a path in frame local.
/// @param margin_m  distance at which a limit already applies; infinite: all limits apply
void limit_speeds(const Zones& zones, const LocalFromWorld& frame, double margin_m, Path* path);

}  // namespace rcs::bg

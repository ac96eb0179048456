#include "modules/bg/zone_ground.h"

#include <algorithm>
#include <cmath>

namespace rcs::bg {
namespace {

// Of a vehicle that leaves forbidden ground: the clearance that is required at a distance from it.
constexpr double kTurn_m = 6.0;  // so far it may turn
constexpr double kRing_m = 8.0;
constexpr double kGain = 0.25;  // of the distance

Vec2 turned(double yaw_rad, const Vec2& p) {
  const double c = std::cos(yaw_rad);
  const double s = std::sin(yaw_rad);
  return {c * p.x() - s * p.y(), s * p.x() + c * p.y()};
}

}  // namespace

LocalFromWorld LocalFromWorld::between(const Pose2d& in_world, const Pose2d& in_local) {
  const double yaw_rad = in_local.heading_rad - in_world.heading_rad;
  return {yaw_rad,
          Vec2(in_local.x_m, in_local.y_m) - turned(yaw_rad, {in_world.x_m, in_world.y_m})};
}

Pose2d LocalFromWorld::to_world(const Pose2d& in_local) const {
  const Vec2 p = turned(-yaw_rad, Vec2(in_local.x_m, in_local.y_m) - origin_m);
  return {p.x(), p.y(), in_local.heading_rad - yaw_rad, in_local.curvature_1pm};
}

void ZoneGround::mark(const Zones& zones, const LocalFromWorld& frame, const ZoneGuard& guard,
                      const Pose2d& vehicle, vj::Terrain* terrain) {
  const ZoneWindow window{terrain->cell_m, terrain->first, terrain->width,
                          terrain->height, frame.yaw_rad,  frame.origin_m};
  double required_m = guard.required_m();
  mark(zones, window, required_m, vehicle, 0.0, terrain);
  const double reach_m = terrain->cell_m * (terrain->width + terrain->height);
  double beyond_m = kTurn_m;
  while (required_m < guard.usual_m() && beyond_m + kRing_m < reach_m) {
    beyond_m += kRing_m;
    required_m = std::min(guard.usual_m(), required_m + kGain * kRing_m);
    mark(zones, window, required_m, vehicle, beyond_m, terrain);
  }
}

void ZoneGround::mark(const Zones& zones, const ZoneWindow& window, double required_m,
                      const Pose2d& vehicle, double beyond_m, vj::Terrain* terrain) {
  const std::vector<std::uint8_t>& forbidden = raster_.forbidden(zones, window, required_m);
  std::size_t k = 0;
  for (int j = 0; j < window.height; ++j) {
    const double y_m = (window.first.j + j + 0.5) * window.cell_m - vehicle.y_m;
    for (int i = 0; i < window.width; ++i, ++k) {
      const double x_m = (window.first.i + i + 0.5) * window.cell_m - vehicle.x_m;
      if (forbidden[k] == 0 || x_m * x_m + y_m * y_m < beyond_m * beyond_m) continue;
      // Unknown ground is passable: an obstacle is known.
      terrain->ground[k].known = terrain->ground[k].obstacle = true;
    }
  }
}

const std::vector<std::uint8_t>& ZoneGround::forbidden(const Zones& zones,
                                                       const LocalFromWorld& frame,
                                                       const ZoneGuard& guard,
                                                       const RememberedGround& ground,
                                                       double body_m) {
  constexpr int kCells = RememberedGround::kCells;
  const ZoneWindow window{RememberedGround::kCell_m,
                          ground.per_m().origin(),
                          kCells,
                          kCells,
                          frame.yaw_rad,
                          frame.origin_m};
  return far_raster_.forbidden(zones, window, guard.required_m() + body_m);
}

void limit_speeds(const Zones& zones, const LocalFromWorld& frame, double margin_m, Path* path) {
  for (PathPoint& p : *path) {
    const Pose2d in_world = frame.to_world(p.place);
    p.zone_mps = zones.speed_limit_mps({in_world.x_m, in_world.y_m}, margin_m);
    p.road_mps = zones.road_speed_mps({in_world.x_m, in_world.y_m}, margin_m);
  }
}

}  // namespace rcs::bg

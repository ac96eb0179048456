#include "sim/terrain/clearance.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace rcs::sim {
namespace {

constexpr double kReach_m = 20.0;
constexpr double kLargest_m = 3.0;  // radius of a crown
// Lower objects pass under the vehicle or its wheels, higher ones over its roof.
constexpr double kLow_m = 0.3;
constexpr double kHigh_m = 2.2;

/// Signed distance of a position from the rectangle, negative inside.
double distance(const Footprint& rectangle, const Vec2& p_vehicle) {
  const Vec2 beyond(std::abs(p_vehicle.x()) - 0.5 * rectangle.length_m,
                    std::abs(p_vehicle.y()) - 0.5 * rectangle.width_m);
  const double outside = beyond.cwiseMax(0.0).norm();
  return outside > 0.0 ? outside : beyond.maxCoeff();
}

/// Largest radius of a spheroid between two heights; negative: it does not extend there.
double radius_between(const Spheroid& o, double low_m, double high_m) {
  const double nearest_m = std::clamp(o.centre_world.z(), low_m, high_m);
  const double share = (nearest_m - o.centre_world.z()) / o.half_height_m;
  return std::abs(share) < 1.0 ? o.radius_m * std::sqrt(1.0 - share * share) : -1.0;
}

}  // namespace

Clearance clearance(const World& world, const Pose& T_world_vehicle, const Footprint& footprint) {
  const Vec2 place = T_world_vehicle.p.head<2>();
  const Vec2 ahead = (T_world_vehicle.q * Vec3::UnitX()).head<2>().normalized();
  const double half_diagonal_m = 0.5 * std::hypot(footprint.length_m, footprint.width_m);
  std::vector<Spheroid> near;
  near.reserve(256);
  world.objects_near(place, kReach_m + half_diagonal_m + kLargest_m, &near);

  Clearance nearest;
  for (const Spheroid& o : near) {
    const Vec2 p = o.centre_world.head<2>() - place;
    const double away_m =
        distance(footprint, {ahead.dot(p), ahead.x() * p.y() - ahead.y() * p.x()});
    const bool hard = o.extinction_1pm == 0.0;
    // The height of the ground is the most expensive test and comes last.
    if (away_m - o.radius_m >= (hard ? std::min(nearest.hard_m, kReach_m) : 0.0)) continue;
    const double ground_m = world.height(o.centre_world.x(), o.centre_world.y());
    if (hard) {
      const bool rises = o.centre_world.z() + o.half_height_m - ground_m > kLow_m;
      if (rises) nearest.hard_m = away_m - o.radius_m;
    } else {
      const double radius_m = radius_between(o, ground_m + kLow_m, ground_m + kHigh_m);
      nearest.foliage = nearest.foliage || away_m < radius_m;
    }
  }
  return nearest;
}

}  // namespace rcs::sim

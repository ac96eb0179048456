#include "tools/driving/zone_course.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "modules/bg/zone_ground.h"

namespace rcs::driving {
namespace {

constexpr double kFence_m = 40.0;
constexpr double kShortestLeg_m = 40.0;

std::string feature(const Zone& zone, const LocalFrame& world) {
  std::string text =
      fmt::format(R"({{"type":"Feature","properties":{{"kind":"{}","name":"{}"}},"geometry":)"
                  R"({{"type":"Polygon","coordinates":[[)",
                  zone.kind == ZoneKind::kFence ? "fence" : "keep_out", zone.name);
  const ZoneRing& ring = zone.polygons.front().outer;
  for (std::size_t k = 0; k <= ring.size(); ++k) {
    const Vec2& p = ring[k % ring.size()];
    const Geodetic g = world.to_geodetic({p.x(), p.y(), 0.0});
    text +=
        fmt::format("{}[{:.9f},{:.9f}]", k > 0 ? "," : "", degrees(g.lon_rad), degrees(g.lat_rad));
  }
  return text + "]]}}";
}

}  // namespace

std::vector<Zone> draw_zones(const std::vector<Vec2>& waypoints_world, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto between = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1.0p-53;
  };
  Vec2 low = waypoints_world.front();
  Vec2 high = low;
  for (const Vec2& p : waypoints_world) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  low -= Vec2::Constant(kFence_m);
  high += Vec2::Constant(kFence_m);
  std::vector<Zone> zones;
  zones.push_back({ZoneKind::kFence,
                   "site",
                   0.0,
                   {{{low, {high.x(), low.y()}, high, {low.x(), high.y()}}, {}}}});
  for (std::size_t k = 2; k < waypoints_world.size(); ++k) {
    const Vec2 leg = waypoints_world[k] - waypoints_world[k - 1];
    const double along = between(0.4, 0.6);
    const double beside_m = between(-4.0, 4.0);
    const Vec2 half(between(3.0, 8.0), between(3.0, 8.0));
    const double turn = between(0.0, kPi);
    if (leg.norm() < kShortestLeg_m) continue;
    const Vec2 left = Vec2(-leg.y(), leg.x()) / leg.norm();
    const Vec2 middle = waypoints_world[k - 1] + along * leg + beside_m * left;
    ZoneRing ring;
    for (const Vec2& corner : {Vec2(-1, -1), Vec2(1, -1), Vec2(1, 1), Vec2(-1, 1)}) {
      const Vec2 p = corner.cwiseProduct(half);
      ring.emplace_back(middle.x() + std::cos(turn) * p.x() - std::sin(turn) * p.y(),
                        middle.y() + std::sin(turn) * p.x() + std::cos(turn) * p.y());
    }
    zones.push_back(
        {ZoneKind::kKeepOut, fmt::format("keep-out {}", k - 1), 0.0, {{std::move(ring), {}}}});
  }
  return zones;
}

std::string to_geojson(const std::vector<Zone>& zones, const LocalFrame& world) {
  std::string text = R"({"type":"FeatureCollection","features":[)";
  for (std::size_t k = 0; k < zones.size(); ++k) {
    text += (k > 0 ? ",\n" : "\n") + feature(zones[k], world);
  }
  return text + "\n]}\n";
}

void ZoneJudge::note(const Pose& T_world_vehicle) {
  if (!outcome_.judged) return;
  const Vec3 ahead = T_world_vehicle.q * Vec3::UnitX();
  const double clearance_m = bg::zone_clearance(
      zones_, body_,
      {T_world_vehicle.p.x(), T_world_vehicle.p.y(), std::atan2(ahead.y(), ahead.x()), 0.0});
  outcome_.min_clearance_m = std::min(outcome_.min_clearance_m, clearance_m);
  outcome_.entries += clearance_m < 0.0 && !inside_ ? 1 : 0;
  inside_ = clearance_m < 0.0;
}

}  // namespace rcs::driving

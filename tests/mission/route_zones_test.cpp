// Routes and operating zones.

#include <gtest/gtest.h>

#include "modules/mission/route_choice.h"

namespace rcs::mission {
namespace {

constexpr double kSpeed_mps = 4.0;

Zone box(ZoneKind kind, const Vec2& low, const Vec2& high, double speed_mps = 0.0) {
  return {kind,
          "box",
          speed_mps,
          {{{low, Vec2(high.x(), low.y()), high, Vec2(low.x(), high.y())}, {}}}};
}

RouteMap open_ground() {
  return {Area{Vec2(-200.0, -200.0), Vec2(200.0, 200.0)}, RouteMapParams()};
}

double min_clearance_m(const Zones& zones, const RouteLine& line) {
  double least = 1e9;
  for (std::size_t k = 1; k < line.size(); ++k) {
    for (double t = 0.0; t <= 1.0; t += 0.01) {
      least = std::min(least, zones.clearance(line[k - 1] + t * (line[k] - line[k - 1])).m);
    }
  }
  return least;
}

const Vec2 kFrom(-150.0, 3.0);
const Vec2 kTo(150.0, -2.0);

TEST(RouteZones, ARouteKeepsItsClearanceFromAKeepOut) {
  const Zones zones({box(ZoneKind::kKeepOut, {-10.0, -60.0}, {10.0, 80.0})});
  RouteMap map = open_ground();
  RouteSearch search;
  EXPECT_LT(min_clearance_m(zones, search.find(map, kFrom, kTo, 0.0)), 0.0);
  for (const double clearance_m : {0.0, 5.0, 20.0}) {
    map.set_zones(zones, clearance_m, kSpeed_mps);
    const RouteLine line = search.find(map, kFrom, kTo, 0.0);
    ASSERT_FALSE(line.empty());
    // The centre of every cell on the way keeps it.
    EXPECT_GT(min_clearance_m(zones, line), clearance_m - 0.75 * map.cell_m()) << clearance_m;
    EXPECT_LT(length_m(line), 340.0 + 2.0 * clearance_m) << "around the nearer end";
  }
  map.set_zones({}, 20.0, kSpeed_mps);
  EXPECT_NEAR(length_m(search.find(map, kFrom, kTo, 0.0)), 300.0, 5.0) << "nothing remains";
}

TEST(RouteZones, NoRouteLeavesAFence) {
  RouteMap map = open_ground();
  RouteSearch search;
  map.set_zones(Zones({box(ZoneKind::kFence, {-160.0, -20.0}, {100.0, 20.0})}), 2.0, kSpeed_mps);
  EXPECT_TRUE(search.find(map, kFrom, Vec2(150.0, 100.0), 0.0).empty());
  EXPECT_FALSE(search.find(map, kFrom, Vec2(90.0, 0.0), 0.0).empty());
}

TEST(RouteZones, ASlowZoneCostsItsTime) {
  RouteMap map = open_ground();
  RouteSearch search;
  const RouteLine straight = {kFrom, kTo};
  map.set_zones(Zones({box(ZoneKind::kSpeed, {-50.0, -60.0}, {50.0, 60.0}, 1.0)}), 2.0, kSpeed_mps);
  // 100 m of the way take four times as long: 60 m up and down are cheaper.
  EXPECT_NEAR(driving_time_s(map, straight, kSpeed_mps), 200.0 / 4.0 + 100.0 / 1.0, 8.0);
  const RouteLine around = search.find(map, kFrom, kTo, 0.0);
  EXPECT_LT(driving_time_s(map, around, kSpeed_mps), 95.0);
  map.set_zones(Zones({box(ZoneKind::kSpeed, {-5.0, -60.0}, {5.0, 60.0}, 2.0)}), 2.0, kSpeed_mps);
  EXPECT_LT(length_m(search.find(map, kFrom, kTo, 0.0)), 305.0) << "a short one is driven through";
  map.set_zones(Zones({box(ZoneKind::kSpeed, {-50.0, -60.0}, {50.0, 60.0}, 9.0)}), 2.0, kSpeed_mps);
  EXPECT_LT(length_m(search.find(map, kFrom, kTo, 0.0)), 305.0) << "faster than the vehicle";
}

}  // namespace
}  // namespace rcs::mission

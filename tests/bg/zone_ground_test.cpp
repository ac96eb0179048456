#include "modules/bg/zone_ground.h"

#include <gtest/gtest.h>

#include <limits>

#include "modules/bg/path_follow.h"
#include "modules/bg/zone_guard.h"

namespace rcs::bg {
namespace {

Zone square(ZoneKind kind, double x_m, double y_m, double half_m, double speed_mps = 0.0) {
  Zone zone;
  zone.kind = kind;
  zone.name = "square";
  zone.speed_mps = speed_mps;
  zone.polygons.push_back({{{x_m - half_m, y_m - half_m},
                            {x_m + half_m, y_m - half_m},
                            {x_m + half_m, y_m + half_m},
                            {x_m - half_m, y_m + half_m}},
                           {}});
  return zone;
}

vj::Terrain level_terrain() {
  vj::Terrain terrain;
  terrain.first = {-50, -50};
  terrain.width = terrain.height = 100;
  terrain.ground.assign(std::size_t{100} * 100, vj::Ground{});
  return terrain;
}

/// Level ground along the x axis, 80 m ahead, all seen.
vj::Terrain known_strip() {
  vj::Terrain terrain = level_terrain();
  terrain.first = {-10, -50};
  terrain.width = 400;
  terrain.ground.assign(std::size_t{400} * 100, vj::Ground{});
  for (vj::Ground& g : terrain.ground) g.known = true;
  return terrain;
}

/// Along the x axis, a point each half metre.
Path straight_path(double length_m) {
  Path path;
  for (double s_m = 0.0; s_m <= length_m; s_m += 0.5) {
    PathPoint p;
    p.place = {s_m, 0.0, 0.0, 0.0};
    p.s_m = s_m;
    p.clearance_m = 50.0;
    path.push_back(p);
  }
  return path;
}

bool blocked(const vj::Terrain& terrain, double x_m, double y_m) {
  return !vj::passable(terrain.at(terrain.cell_at(x_m, y_m)), {});
}

TEST(LocalFromWorld, MapsThePoseFromWhichItWasMade) {
  const Pose2d in_world{12.0, -7.0, 0.4, 0.1};
  const Pose2d in_local{3.0, 5.0, -1.1, 0.1};
  const LocalFromWorld frame = LocalFromWorld::between(in_world, in_local);
  const Pose2d back = frame.to_world(in_local);
  EXPECT_NEAR(back.x_m, in_world.x_m, 1e-12);
  EXPECT_NEAR(back.y_m, in_world.y_m, 1e-12);
  EXPECT_NEAR(wrap_angle(back.heading_rad - in_world.heading_rad), 0.0, 1e-12);
  // Two metres ahead in the one frame are two metres ahead in the other.
  const Pose2d ahead = frame.to_world(along_arc({3.0, 5.0, -1.1, 0.0}, 2.0));
  const Pose2d expected = along_arc({12.0, -7.0, 0.4, 0.0}, 2.0);
  EXPECT_NEAR(ahead.x_m, expected.x_m, 1e-12);
  EXPECT_NEAR(ahead.y_m, expected.y_m, 1e-12);
}

TEST(ZoneGround, MarksWhereTheFrameHasTheZoneWithItsMargin) {
  const Zones zones({square(ZoneKind::kKeepOut, 105.0, 0.0, 2.0)});
  ZoneGround ground;
  ZoneGuard guard;
  guard.update(30.0, 0.5);  // requires 1 m
  vj::Terrain terrain = level_terrain();
  // The vehicle is at 100, 0 and drives east; frame local begins there, turned by a quarter.
  LocalFromWorld frame = LocalFromWorld::between({100.0, 0.0, 0.0, 0.0}, {0.0, 0.0, kPi / 2, 0.0});
  ground.mark(zones, frame, guard, {}, &terrain);
  EXPECT_TRUE(blocked(terrain, 0.0, 5.0));
  EXPECT_TRUE(blocked(terrain, 0.0, 2.5));
  EXPECT_TRUE(blocked(terrain, 2.7, 5.0));
  EXPECT_FALSE(blocked(terrain, 0.0, 1.5));
  EXPECT_FALSE(blocked(terrain, 5.0, 0.0));
  // Frame world steps by 3 m: the zone is nearer.
  terrain = level_terrain();
  frame = LocalFromWorld::between({103.0, 0.0, 0.0, 0.0}, {0.0, 0.0, kPi / 2, 0.0});
  ground.mark(zones, frame, guard, {}, &terrain);
  EXPECT_TRUE(blocked(terrain, 0.0, 0.0));
  EXPECT_FALSE(blocked(terrain, 0.0, 5.5));
}

// 10 m inside of a large zone: around the vehicle as deep as it is, and less deep farther away.
TEST(ZoneGround, TheWayOutGainsClearanceWithTheDistance) {
  const Zones zones({square(ZoneKind::kKeepOut, 0.0, -90.0, 100.0)});
  ZoneGround ground;
  ZoneGuard guard;
  guard.update(-10.0, 1.0);
  vj::Terrain terrain = level_terrain();
  ground.mark(zones, {}, guard, {}, &terrain);
  EXPECT_FALSE(blocked(terrain, 0.0, 0.0));
  EXPECT_FALSE(blocked(terrain, 6.0, 0.0));
  EXPECT_TRUE(blocked(terrain, 0.0, -1.5));
  EXPECT_TRUE(blocked(terrain, 16.0, 0.0)) << "along the border";
  EXPECT_FALSE(blocked(terrain, 0.0, 16.0)) << "straight out";
  EXPECT_FALSE(blocked(terrain, 10.0, 8.0));
}

TEST(ZoneGround, OnAMappedRoadTheVehicleIsFasterThanItsSightOfDitchesAllows) {
  const Zones zones({square(ZoneKind::kRoad, 40.0, 0.0, 20.0, 9.0)});
  Path path = straight_path(80.0);
  const vj::Terrain terrain = known_strip();
  vj::SpeedParams speeds;
  speeds.sight_mps = 5.0;
  const auto speed_at = [&](double s_m) {
    return path[static_cast<std::size_t>(s_m / 0.5)].limit_mps;
  };
  limit_speeds(zones, {}, 1.5, &path);
  plan_speeds(terrain, {}, speeds, {}, {}, 20.0, 1.0, &path);
  EXPECT_EQ(speed_at(10.0), 5.0);
  EXPECT_EQ(speed_at(21.0), 5.0) << "within the bound of the position error of the border";
  EXPECT_EQ(speed_at(40.0), 9.0);
  EXPECT_EQ(speed_at(70.0), 5.0);
  EXPECT_LT(path[116].speed_mps, 6.0) << "brakes before the end of the road";
  limit_speeds(zones, {}, std::numeric_limits<double>::infinity(), &path);
  plan_speeds(terrain, {}, speeds, {}, {}, 20.0, 1.0, &path);
  EXPECT_EQ(speed_at(40.0), 5.0) << "the vehicle may be elsewhere";
}

TEST(ZoneGround, SpeedZonesLimitThePathAndTheWayToThem) {
  const Zones zones({square(ZoneKind::kSpeed, 20.0, 0.0, 5.0, 1.0)});
  Path path = straight_path(40.0);
  limit_speeds(zones, {}, 1.0, &path);
  const vj::Terrain terrain = known_strip();
  const FollowParams follow;
  plan_speeds(terrain, {}, {}, follow, {}, 5.0, 1.0, &path);
  for (const PathPoint& p : path) {
    const double away_m = std::abs(p.place.x_m - 20.0) - 6.0;
    if (away_m <= 0.0) {
      EXPECT_LE(p.speed_mps, 1.0) << p.place.x_m;
    } else if (p.place.x_m < 14.0) {
      EXPECT_LE(p.speed_mps, std::sqrt(1.0 + 2.0 * follow.braking_mps2 * (away_m + 0.5)) + 1e-9);
    }
  }
  EXPECT_GT(path[2].speed_mps, 4.0);
  limit_speeds(zones, {}, 1e9, &path);
  EXPECT_EQ(path[0].zone_mps, 1.0) << "the vehicle may be anywhere";
}

TEST(ZoneGuard, KeepsTheProtectionLevelAndAConstant) {
  ZoneGuard guard;
  guard.update(30.0, 2.0);
  EXPECT_FALSE(guard.too_near());
  EXPECT_DOUBLE_EQ(guard.required_m(), 2.5);
  guard.update(2.2, 2.0);  // within the constant: nothing changes
  EXPECT_FALSE(guard.too_near());
  EXPECT_DOUBLE_EQ(guard.required_m(), 2.5);
}

// A sequence of motions does not lead further in than the first time.
TEST(ZoneGuard, TheWayOutOnlyOpensOutwards) {
  ZoneGuard guard;
  guard.update(-3.0, 2.0);
  EXPECT_TRUE(guard.too_near());
  const double first_m = guard.required_m();
  EXPECT_LT(first_m, -3.0);
  EXPECT_GT(first_m, -4.0);
  guard.update(-3.5, 2.0);
  EXPECT_DOUBLE_EQ(guard.required_m(), first_m) << "deeper: the limit stays";
  double last_m = first_m;
  for (double clearance_m = -3.5; clearance_m < 4.0; clearance_m += 0.1) {
    guard.update(clearance_m, 2.0);
    EXPECT_GE(guard.required_m(), last_m);
    last_m = guard.required_m();
  }
  EXPECT_FALSE(guard.too_near());
  EXPECT_DOUBLE_EQ(guard.required_m(), 2.5);
  guard.update(-3.0, 2.0);  // frame world has stepped
  guard.reset();
  guard.update(-8.0, 2.0);
  EXPECT_LT(guard.required_m(), -8.0);
}

TEST(ZoneGuard, APathLeadsOutIfItGainsClearanceAndLosesNone) {
  ZoneGuard guard;
  guard.update(-3.0, 1.0);
  Path path(60);
  for (std::size_t k = 0; k < path.size(); ++k) {
    path[k].s_m = path[k].place.x_m = static_cast<double>(k);
  }
  const auto out = [&](double rate, double dip_m) {
    return leads_out(path, 0, guard, [=](const Pose2d& p) {
      return -3.0 + rate * p.x_m - (p.x_m > 3.0 && p.x_m < 7.0 ? dip_m : 0.0);
    });
  };
  EXPECT_TRUE(out(0.1, 0.0));
  EXPECT_TRUE(out(0.1, 0.5)) << "what the outline needs for a turn";
  EXPECT_FALSE(out(0.1, 2.0)) << "further in on the way";
  EXPECT_FALSE(out(0.02, 0.0)) << "along the border";
  EXPECT_FALSE(out(-0.1, 0.0));
  EXPECT_FALSE(leads_out({}, 0, guard, [](const Pose2d&) { return 10.0; }));
}

}  // namespace
}  // namespace rcs::bg

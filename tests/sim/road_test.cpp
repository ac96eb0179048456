#include "sim/terrain/road.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/terrain/relief.h"
#include "sim/terrain/world.h"

namespace rcs::sim {
namespace {

const std::vector<Octave> kHills = {{102.4, 3.0}, {51.2, 1.0}};
const std::vector<Octave> kHillsWithBumps = {{102.4, 3.0}, {51.2, 1.0}, {6.4, 0.3}, {0.8, 0.05}};

/// Eastward through the origin, then to the north-east.
Road road() { return {5.0, 4.0, 40.0, {Vec2(-50.0, 0.0), Vec2(20.0, 0.0), Vec2(60.0, 40.0)}}; }

TEST(Road, DistanceIsFromItsSurface) {
  EXPECT_NEAR(distance_from_road({road()}, 0.0, 6.0), 3.5, 1e-12);
  EXPECT_NEAR(distance_from_road({road()}, 0.0, 1.0), -1.5, 1e-12);
  EXPECT_NEAR(distance_from_road({road()}, 40.0, 20.0), -2.5, 1e-12);
  EXPECT_NEAR(distance_from_road({road()}, -60.0, 0.0), 7.5, 1e-12) << "beyond its end";
  EXPECT_EQ(distance_from_road({}, 0.0, 0.0), std::numeric_limits<double>::infinity());
}

TEST(Road, TheGroundHasNoBumpsOnItAndIsUnchangedBeyondTheShoulder) {
  const Relief hills(7, kHills, {});
  const Relief rough(7, kHillsWithBumps, {});
  const Relief with_road(7, kHillsWithBumps, {}, {}, {road()});
  for (double x = -40.0; x < 15.0; x += 1.7) {
    for (const double y : {-2.4, 0.0, 2.4}) {
      EXPECT_NEAR(with_road.height(x, y), hills.height(x, y), 1e-12);
    }
    for (const double y : {-7.0, 6.6, 30.0}) {
      EXPECT_NEAR(with_road.height(x, y), rough.height(x, y), 1e-12);
    }
  }
}

TEST(Road, FilledTilesAgreeWithTheHeightsAndWithOneAnother) {
  const Relief relief(7, kHillsWithBumps, {}, {}, {road()});
  std::vector<float> a;
  std::vector<float> b;
  relief.fill(-300, -60, 0.1, 129, 120, &a);
  relief.fill(-172, -60, 0.1, 129, 120, &b);
  for (int j = 0; j < 120; ++j) {
    const std::size_t row = static_cast<std::size_t>(j) * 129;
    EXPECT_EQ(a[row + 128], b[row]);
    EXPECT_NEAR(a[row + 7], relief.height(-29.3, (j - 60) * 0.1), 1e-5);
  }
}

TEST(Road, NothingGrowsOnIt) {
  WorldParams params;
  params.octaves = kHills;
  params.rocks.per_m2 = 0.2;
  params.vegetation.bushes_per_m2 = 0.1;
  params.vegetation.trees_per_m2 = 0.05;
  params.clear_m = 0.0;
  const std::vector<Vec2> course = {Vec2(0.0, 100.0)};
  std::vector<Spheroid> without;
  std::vector<Spheroid> with;
  World(params, {}, course, 200.0).objects_near(Vec2::Zero(), 30.0, &without);
  params.roads = {road()};
  const World world(params, {}, course, 200.0);
  world.objects_near(Vec2::Zero(), 30.0, &with);
  EXPECT_GT(with.size(), 100U);
  EXPECT_LT(with.size(), without.size());
  for (const Spheroid& o : with) {
    EXPECT_GE(distance_from_road(params.roads, o.centre_world.x(), o.centre_world.y()), o.radius_m);
  }
  // Of a fan of rays down onto the road none is returned by grass, which takes a random part of it.
  for (std::uint64_t shot = 0; shot < 200; ++shot) {
    const double x = -40.0 + 0.25 * static_cast<double>(shot);
    Hit hit;
    const Ray down{Vec3(x, 0.0, world.height(x, 0.0) + 5.0), -Vec3::UnitZ()};
    ASSERT_TRUE(world.cast(down, 50.0, 0.0, shot, &hit));
    EXPECT_NEAR(hit.range_m, 5.0, 1e-3) << x;
  }
}

}  // namespace
}  // namespace rcs::sim

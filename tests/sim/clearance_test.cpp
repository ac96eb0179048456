#include "sim/terrain/clearance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

const std::vector<Vec2> kPlaces = {{0.0, 0.0}};

WorldParams rocks_only() {
  WorldParams p = bare_hills();
  p.rocks.per_m2 = 0.02;
  p.clear_m = 5.0;
  return p;
}

std::vector<Spheroid> all_near(const World& world) {
  std::vector<Spheroid> out;
  world.objects_near(Vec2::Zero(), 60.0, &out);
  return out;
}

bool rises(const World& world, const Spheroid& o) {
  return o.extinction_1pm == 0.0 && o.centre_world.z() + o.half_height_m -
                                            world.height(o.centre_world.x(), o.centre_world.y()) >
                                        0.3;
}

Pose facing(const Vec2& place, double heading_rad) {
  return {exp_so3(Vec3(0.0, 0.0, heading_rad)), Vec3(place.x(), place.y(), 1.0)};
}

TEST(World, ReportsEveryObjectOnce) {
  const World world(rocks_only(), {}, kPlaces, 80.0);
  const std::vector<Spheroid> all = all_near(world);
  EXPECT_GT(all.size(), 150U);
  for (std::size_t a = 0; a < all.size(); ++a) {
    EXPECT_LE(all[a].centre_world.head<2>().norm(), 60.0);
    EXPECT_GE(all[a].centre_world.head<2>().norm(), 5.0);
    for (std::size_t b = 0; b < a; ++b) EXPECT_NE(all[a].centre_world, all[b].centre_world);
  }
  std::vector<Spheroid> fewer;
  world.objects_near(Vec2::Zero(), 20.0, &fewer);
  std::size_t within = 0;
  for (const Spheroid& o : all) within += o.centre_world.head<2>().norm() <= 20.0 ? 1 : 0;
  EXPECT_EQ(fewer.size(), within);
}

TEST(Clearance, IsTheDistanceFromTheRectangleToTheNearestHighRock) {
  const World world(rocks_only(), {}, kPlaces, 80.0);
  const std::vector<Spheroid> all = all_near(world);
  const Footprint f;
  for (int k = 0; k < 200; ++k) {
    const Vec2 place(0.13 * k - 13.0, 7.0 * std::sin(0.3 * k));
    const Pose T = facing(place, 0.1 * k);
    // By samples of the rectangle's border; a point inside counts as contact.
    double expected = Clearance::kFar_m;
    for (const Spheroid& o : all) {
      if (!rises(world, o)) continue;
      const Vec3 in_vehicle = T.inverse() * o.centre_world;
      const bool inside = std::abs(in_vehicle.x()) < 1.6 && std::abs(in_vehicle.y()) < 1.0;
      double away = std::numeric_limits<double>::infinity();
      for (int n = 0; n <= 1000; ++n) {
        const double s = n / 1000.0 - 0.5;
        for (const Vec2& p :
             {Vec2(s * f.length_m, 0.5 * f.width_m), Vec2(s * f.length_m, -0.5 * f.width_m),
              Vec2(0.5 * f.length_m, s * f.width_m), Vec2(-0.5 * f.length_m, s * f.width_m)}) {
          away = std::min(away, (p - in_vehicle.head<2>()).norm());
        }
      }
      expected = std::min(expected, (inside ? -away : away) - o.radius_m);
    }
    ASSERT_NEAR(clearance(world, T, f).hard_m, expected, 2e-3) << k;
    EXPECT_FALSE(clearance(world, T, f).foliage);
  }
}

TEST(Clearance, LowRocksAreDrivenOver) {
  WorldParams p = rocks_only();
  p.octaves.clear();
  p.rocks.radius_min_m = 0.1;
  p.rocks.radius_max_m = 0.29;
  const World world(p, {}, kPlaces, 80.0);
  for (double x = 5.0; x < 40.0; x += 0.5) {
    EXPECT_EQ(clearance(world, facing({x, 0.0}, 0.0), {}).hard_m, Clearance::kFar_m);
  }
}

TEST(Clearance, BushesAreFoliageAndCrownsOnlyWhereTheyHangLow) {
  WorldParams p = flat_world();
  p.vegetation.bushes_per_m2 = 0.02;
  p.vegetation.trees_per_m2 = 0.02;
  const World world(p, {}, kPlaces, 80.0);
  int bushes = 0;
  int high_crowns = 0;
  for (const Spheroid& o : all_near(world)) {
    const Vec2 place = o.centre_world.head<2>();
    if (o.extinction_1pm == 0.0) {
      EXPECT_LT(clearance(world, facing(place, 0.7), {}).hard_m, 0.0);
    } else if (o.centre_world.z() < 1.5) {
      ++bushes;
      EXPECT_TRUE(clearance(world, facing(place, 0.7), {}).foliage);
    } else if (o.centre_world.z() - o.half_height_m > 2.2) {
      ++high_crowns;
      EXPECT_LT(clearance(world, facing(place, 0.7), {}).hard_m, 0.0);  // its own trunk
    }
  }
  EXPECT_GT(bushes, 20);
  EXPECT_GT(high_crowns, 20);
}

}  // namespace
}  // namespace rcs::sim

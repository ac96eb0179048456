#include "sim/terrain/world.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

WorldParams wild() {
  WorldParams p = bare_hills();
  p.rocks.per_m2 = 0.05;
  p.vegetation.bushes_per_m2 = 0.02;
  p.vegetation.trees_per_m2 = 0.01;
  p.vegetation.grass_height_m = 0.3;
  return p;
}

std::vector<Ray> random_rays(const World& world, int n) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<Ray> rays;
  for (int k = 0; k < n; ++k) {
    const double x = 150.0 * unit(rng);
    const double y = 40.0 * unit(rng);
    const double azimuth = 2.0 * kPi * unit(rng);
    const double elevation = radians(-25.0 + 27.0 * unit(rng));
    rays.push_back({Vec3(x, y, world.height(x, y) + 0.5 + 2.0 * unit(rng)),
                    Vec3(std::cos(elevation) * std::cos(azimuth),
                         std::cos(elevation) * std::sin(azimuth), std::sin(elevation))});
  }
  // Along the axes, and straight down.
  const double z = world.height(60.0, 10.0) + 1.0;
  for (const Vec3& d : {Vec3(1, 0, -0.05), Vec3(-1, 0, -0.05), Vec3(0, 1, -0.05),
                        Vec3(0, -1, -0.05), Vec3(0, 0, -1)}) {
    rays.push_back({Vec3(60.0, 10.0, z), d.normalized()});
  }
  return rays;
}

TEST(World, RayIntersectionsMatchThoseOfSmallSteps) {
  const Course course(s_course());
  const World world(bare_hills(), {}, course.points(), 80.0);
  int hits = 0;
  for (const Ray& ray : random_rays(world, 400)) {
    Hit hit;
    const bool met = world.cast(ray, 60.0, 0.0, 1, &hit);
    double marched = 60.0;
    constexpr double kStep = 0.005;
    for (double r = kStep; r < 60.0; r += kStep) {
      const Vec3 p = ray.origin_world + r * ray.direction_world;
      if (!world.contains(p.x(), p.y())) break;
      if (p.z() <= world.height(p.x(), p.y())) {
        marched = r;
        break;
      }
    }
    ASSERT_EQ(met, marched < 60.0);
    if (!met) continue;
    ++hits;
    // The march may step over the tip of a grazed surface, but never stops before the intersection
    // of the ray.
    EXPECT_LE(hit.range_m, marched + 1e-9);
    const Vec3 p = ray.origin_world + hit.range_m * ray.direction_world;
    EXPECT_NEAR(p.z(), world.height(p.x(), p.y()), 1e-6);
    EXPECT_NEAR(hit.cos_incidence, std::abs(world.normal(p.x(), p.y()).dot(ray.direction_world)),
                1e-3);
    if (marched - hit.range_m > kStep) {
      const Vec3 tip = ray.origin_world + (hit.range_m + 0.5 * kStep) * ray.direction_world;
      EXPECT_LT(std::abs(tip.z() - world.height(tip.x(), tip.y())), kStep);
    }
  }
  EXPECT_GT(hits, 200);
}

// The clear distance of a fan must be empty: every ray of the fan has the same intersection with
// and without it, and none earlier.
TEST(World, NothingIsHitWithinAFansClearDistance) {
  const Course course(s_course());
  WorldParams params = wild();
  params.vegetation.transmittance_per_m = 1e-6;  // a ray ends where foliage begins
  params.vegetation.grass_height_m = 0.0;  // foliage begins before the intersection of the ray
  params.rocks.per_m2 = 0.3;
  const World world(params, {}, course.points(), 80.0);
  double clear_sum_m = 0.0;
  for (const Ray& middle : random_rays(world, 1500)) {
    std::vector<Ray> rays;
    for (int k = -10; k <= 10; ++k) {
      const Quat turn = exp_so3(Vec3(0.0, 0.002 * (k % 3), radians(1.5) * k));
      rays.push_back(
          {middle.origin_world + Vec3(0.004 * k, 0.002 * k, 0.0), turn * middle.direction_world});
    }
    const double clear_m = world.clear_distance(Fan(rays), 60.0);
    clear_sum_m += clear_m;
    for (const Ray& ray : rays) {
      Hit plain, spared;
      const bool met = world.cast(ray, 60.0, 1.0, 5, &plain);
      if (met && ray.direction_world.head<2>().norm() > 0.1) {
        ASSERT_GE(plain.range_m, clear_m);
      }
      ASSERT_EQ(world.cast(ray, 60.0, 1.0, 5, &spared, clear_m), met);
      if (met) {
        ASSERT_NEAR(spared.range_m, plain.range_m, 1e-9);
      }
    }
  }
  EXPECT_GT(clear_sum_m / 1500, 1.5);  // otherwise it saves nothing
}

TEST(World, DoesNotDependOnTheOrderOfQueries) {
  const Course course(s_course());
  const World a(wild(), {}, course.points(), 80.0);
  const World b(wild(), {}, course.points(), 80.0);
  const std::vector<Ray> rays = random_rays(a, 500);
  std::vector<double> ranges;
  for (const Ray& ray : rays) {
    Hit hit;
    ranges.push_back(a.cast(ray, 60.0, 2.0, 9, &hit) ? hit.range_m : -1.0);
  }
  b.forget_beyond(0.0, 0.0, 20.0);
  for (std::size_t k = rays.size(); k-- > 0;) {
    if (k == rays.size() / 2) b.forget_beyond(0.0, 0.0, 20.0);
    Hit hit;
    EXPECT_EQ(b.cast(rays[k], 60.0, 2.0, 9, &hit) ? hit.range_m : -1.0, ranges[k]);
  }
}

TEST(World, NeighbouringTilesShareTheirBorder) {
  const Course course(s_course());
  const World world(bare_hills(), {}, course.points(), 80.0);
  for (double y = 0.03; y < 25.0; y += 0.37) {
    const double border_m = 2 * Tile::kSize_m;
    EXPECT_NEAR(world.height(border_m - 1e-7, y), world.height(border_m + 1e-7, y), 1e-5);
  }
}

TEST(World, NoObjectIsOnTheCourse) {
  WorldParams params = flat_world();
  params.rocks.per_m2 = 0.5;
  params.vegetation.trees_per_m2 = 0.1;
  const Course course(s_course());
  const World world(params, {}, course.points(), 80.0);
  for (const Vec2& p : course.points()) {
    Hit hit;
    const Ray down{Vec3(p.x(), p.y(), 20.0), -Vec3::UnitZ()};
    ASSERT_TRUE(world.cast(down, 30.0, 0.0, 1, &hit));
    EXPECT_NEAR(hit.range_m, 20.0, 1e-6);
  }
}

TEST(World, RaysHitRocks) {
  WorldParams params = flat_world();
  params.rocks.per_m2 = 0.3;
  const Course course(s_course());
  const World world(params, {}, course.points(), 80.0);
  int rocks = 0;
  for (double y = 15.0; y < 40.0; y += 0.25) {
    Hit hit;
    const Ray level{Vec3(20.0, y, 0.05), Vec3::UnitX()};
    if (world.cast(level, 60.0, 0.0, 1, &hit)) ++rocks;
  }
  // 0.3 rocks/m^2, about 0.3 m in diameter, over 60 m: nearly every ray hits one.
  EXPECT_GT(rocks, 80);
}

TEST(World, FoliageTransmitsItsShareOfLight) {
  WorldParams params = flat_world();
  params.vegetation.bushes_per_m2 = 0.2;
  params.vegetation.sway_m = 0.0;
  params.vegetation.transmittance_per_m = 0.5;
  const Course course(s_course());
  const World thin(params, {}, course.points(), 80.0);
  params.vegetation.transmittance_per_m = 0.001;
  const World dense(params, {}, course.points(), 80.0);
  int met_thin = 0;
  int met_dense = 0;
  for (int k = 0; k < 2000; ++k) {
    const Ray level{Vec3(20.0, 15.0 + 0.01 * k, 0.5), Vec3::UnitX()};
    Hit hit;
    if (thin.cast(level, 5.0, 0.0, mix(static_cast<std::uint64_t>(k)), &hit)) ++met_thin;
    if (dense.cast(level, 5.0, 0.0, mix(static_cast<std::uint64_t>(k)), &hit)) ++met_dense;
  }
  EXPECT_GT(met_thin, 0);
  EXPECT_LT(met_thin, 0.85 * met_dense);
}

TEST(World, VegetationMovesAndRocksDoNot) {
  const Course course(s_course());
  WorldParams params = flat_world();
  params.vegetation.bushes_per_m2 = 0.2;
  const World bushes(params, {}, course.points(), 80.0);
  params = flat_world();
  params.vegetation.grass_height_m = 0.0;  // foliage begins before the intersection of the ray
  params.rocks.per_m2 = 0.3;
  const World rocks(params, {}, course.points(), 80.0);
  int moved = 0;
  for (int k = 0; k < 200; ++k) {
    const Ray level{Vec3(20.0, 15.0 + 0.1 * k, 0.1), Vec3::UnitX()};
    Hit a, b;
    if (bushes.cast(level, 50.0, 0.0, 7, &a) && bushes.cast(level, 50.0, 0.7, 7, &b) &&
        a.range_m != b.range_m) {
      ++moved;
    }
    const bool before = rocks.cast(level, 50.0, 0.0, 7, &a);
    EXPECT_EQ(before, rocks.cast(level, 50.0, 0.7, 7, &b));
    EXPECT_EQ(a.range_m, b.range_m);
  }
  EXPECT_GT(moved, 50);
}

TEST(World, RaysThatLeaveTheWorldHitNothing) {
  const Course course(s_course());
  const World world(flat_world(), {}, course.points(), 20.0);
  Hit hit;
  EXPECT_FALSE(world.cast({Vec3(0, 0, 1.0), -Vec3::UnitX()}, 500.0, 0.0, 1, &hit));
  EXPECT_FALSE(world.cast({Vec3(1e4, 0, 1.0), Vec3::UnitX()}, 500.0, 0.0, 1, &hit));
  EXPECT_FALSE(world.cast({Vec3(0, 0, 1.0), Vec3::UnitZ()}, 500.0, 0.0, 1, &hit));
}

}  // namespace
}  // namespace rcs::sim

#include "tools/mapping/standing_builder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace rcs {
namespace {

constexpr double kWall_m = 10.0;  // x
const Vec2 kTrunk(6.0, 4.0);
constexpr double kTrunkRadius_m = 0.25;
const Vec2 kBush(6.0, -4.0);
constexpr double kParked_m = -6.0;  // x of the side of a car that leaves

/// A vehicle drives along y between a wall, a trunk, a bush and a car that is present in some
/// scans.
mapping::StandingBuilder driven_past(unsigned seed) {
  mapping::StandingBuilder builder{mapping::StandingParams{}};
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.02);
  for (std::uint32_t scan = 1; scan <= 20; ++scan) {
    const Vec3 from(0.0, -5.0 + 0.5 * scan, 1.8);
    for (int k = 0; k < 1500; ++k) {
      const Vec3 wall(kWall_m + noise(rng), 10.0 * u(rng), 1.5 + u(rng));
      builder.add(wall, from, scan);
    }
    for (int k = 0; k < 60; ++k) {
      // The side that faces the vehicle.
      const double towards = std::atan2(from.y() - kTrunk.y(), from.x() - kTrunk.x());
      const double turn = towards + 1.3 * u(rng);
      const double r = kTrunkRadius_m + noise(rng);
      builder.add(Vec3(kTrunk.x() + r * std::cos(turn), kTrunk.y() + r * std::sin(turn),
                       1.5 + 0.8 * u(rng)),
                  from, scan);
      const Vec3 leaf(kBush.x() + 0.6 * u(rng), kBush.y() + 0.6 * u(rng), 1.2 + 0.6 * u(rng));
      builder.add(leaf, from, scan);
      if (scan <= 3) {
        builder.add(Vec3(kParked_m + noise(rng), 2.0 * u(rng), 1.0 + 0.4 * u(rng)), from, scan);
      }
    }
  }
  builder.finish([](double, double) { return false; });
  return builder;
}

std::vector<SurfacePoint> all_of(const mapping::StandingBuilder& builder) {
  MapLevel level;
  level.cell_m = 0.2;
  std::vector<SurfacePoint> points;
  for (int k = 0; k < 4; ++k) {
    const Cell tile{k % 2 - 1, k / 2 - 1};
    for (SurfacePoint p : builder.points(level, tile)) {
      p.p_m += Vec3f(51.2F * static_cast<float>(tile.i), 51.2F * static_cast<float>(tile.j), 0.0F);
      points.push_back(p);
    }
  }
  return points;
}

TEST(StandingBuilder, WallsAndTrunksAreKeptAndFoliageAndTransientsAreNot) {
  int wall = 0;
  int trunk = 0;
  int bush = 0;
  const std::vector<SurfacePoint> points = all_of(driven_past(1));
  for (const SurfacePoint& p : points) {
    EXPECT_GT(p.p_m.x(), kParked_m + 1.0) << "the car";
    const Vec2 at = p.p_m.head<2>().cast<double>();
    EXPECT_LT(p.sigma_m, 0.09F);
    if ((at - kBush).norm() < 1.5) {
      ++bush;
    } else if (p.p_m.x() > 9.0F) {
      ++wall;
      EXPECT_NEAR(p.p_m.x(), kWall_m, 0.03);
      EXPECT_LT(p.normal.x(), -0.98F);
    } else {
      ++trunk;
      const Vec2 out = at - kTrunk;
      EXPECT_NEAR(out.norm(), kTrunkRadius_m, 0.08);
      EXPECT_GT(out.normalized().dot(p.normal.head<2>().cast<double>()), 0.7);
    }
  }
  EXPECT_GT(wall, 400);
  EXPECT_GT(trunk, 10);
  EXPECT_LT(bush, 20) << "of some 400 cubes, at its edges";
}

TEST(StandingBuilder, TheSameReturnsGiveTheSamePoints) {
  EXPECT_TRUE(all_of(driven_past(2)) == all_of(driven_past(2)));
  EXPECT_FALSE(all_of(driven_past(2)) == all_of(driven_past(3)));
}

TEST(StandingBuilder, PointsAboveObservedGroundAreOmitted) {
  mapping::StandingBuilder builder{mapping::StandingParams{}};
  std::mt19937 rng(4);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (std::uint32_t scan = 1; scan <= 10; ++scan) {
    for (int k = 0; k < 1500; ++k) {
      builder.add(Vec3(kWall_m, 5.0 * u(rng), 1.5 + u(rng)), Vec3(0.0, 0.5 * scan, 1.8), scan);
    }
  }
  builder.finish([](double, double y) { return y > 0.0; });
  const std::vector<SurfacePoint> points = all_of(builder);
  ASSERT_FALSE(points.empty());
  for (const SurfacePoint& p : points) EXPECT_LE(p.p_m.y(), 0.0F);
}

TEST(StandingBuilder, PositionsOutOfBoundsGiveNoPoints) {
  mapping::StandingBuilder builder{mapping::StandingParams{}};
  for (const double far : {1e7, -1e7, std::nan("")}) {
    builder.add(Vec3(far, 0.0, 0.0), Vec3::Zero(), 1);
    builder.add(Vec3(0.0, 0.0, far), Vec3::Zero(), 1);
  }
  EXPECT_EQ(builder.bytes(), 0U);
}

}  // namespace
}  // namespace rcs

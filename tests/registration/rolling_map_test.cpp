#include "modules/registration/rolling_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "tests/support/point_scenes.h"

namespace rcs::registration {
namespace {

TEST(RollingMap, SurfacesOfAPlaneHaveItsNormal) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> u(-10.0, 10.0);
  const Vec3 n = Vec3(0.2, -0.3, 1.0).normalized();
  Points plane;
  for (int i = 0; i < 40'000; ++i) {
    const double x = u(rng);
    const double y = u(rng);
    plane.push_back(Vec3(x, y, -(n.x() * x + n.y() * y) / n.z()).cast<float>());
  }
  RollingMap map{RollingMapParams{}};
  map.insert(plane, Pose{});
  Surface s{};
  ASSERT_TRUE(map.nearest_surface(Vec3f(0.1F, 0.2F, 0.05F), &s));
  EXPECT_GT(std::abs(s.normal.cast<double>().dot(n)), 0.99999);
  EXPECT_LT(std::abs(s.mean.cast<double>().dot(n)), 1e-4);
  EXPECT_LT(s.variance_m2, 1e-6);
}

TEST(RollingMap, AScanLineIsNoSurface) {
  Points line;
  for (int i = 0; i < 1000; ++i) line.push_back(Vec3f(0.01F * static_cast<float>(i), 0.2F, 0.1F));
  RollingMap map{RollingMapParams{}};
  map.insert(line, Pose{});
  Surface s{};
  EXPECT_FALSE(map.nearest_surface(Vec3f(1.0F, 0.2F, 0.1F), &s));
}

TEST(RollingMap, ManyQueriesAtOnceAreAnsweredLikeSingleOnes) {
  // GIVEN a map with fine and coarse surfaces, and a copy of it
  std::mt19937 rng(7);
  const Points scan = test::scene(test::Ground::kRolling, true, 20'000, 0.02, Vec3::Zero(), &rng);
  RollingMap one{RollingMapParams{}};
  one.insert(scan, Pose{});
  RollingMap many = one;
  // WHEN points on, beside and far from its surfaces are queried, more than a block of them
  std::uniform_real_distribution<float> u(-30.0F, 30.0F);
  std::uniform_real_distribution<float> height(-2.0F, 4.0F);
  std::vector<SurfaceQuery> queries;
  queries.reserve(1001);
  for (int k = 0; k < 1001; ++k) {
    queries.push_back({Vec3f(u(rng), u(rng), height(rng)), k % 2 == 0, {}});
  }
  many.nearest_surfaces(queries.data(), queries.size());
  // THEN the answers are those of single queries
  int found = 0;
  for (const SurfaceQuery& q : queries) {
    Surface s{};
    ASSERT_EQ(one.nearest_surface(q.p, &s), q.found);
    if (!q.found) continue;
    ++found;
    EXPECT_EQ(s.voxel, q.surface.voxel);
    EXPECT_EQ(s.mean, q.surface.mean);
    EXPECT_EQ(s.normal, q.surface.normal);
  }
  EXPECT_GT(found, 100);
  EXPECT_LT(found, 900);
  many.nearest_surfaces(nullptr, 0);
}

TEST(RollingMap, MemoryIsBoundedAndTheFarthestGoFirst) {
  // GIVEN a small map that moves much farther than its radius
  RollingMapParams params;
  params.capacity = 4000;
  params.radius_m = 40.0;
  RollingMap map(params);
  std::mt19937 rng(4);
  Surface s{};
  for (int step = 0; step < 400; ++step) {
    const Vec3 centre(static_cast<double>(step), 0.0, 0.0);
    const Points scan = test::scene(test::Ground::kFlat, false, 3000, 0.01, Vec3::Zero(), &rng);
    map.insert(scan, Pose{Quat::Identity(), centre});
    ASSERT_LE(map.size(), 2U * 4000U);
  }
  // THEN it contains the ground here, and nothing of its start
  EXPECT_TRUE(map.nearest_surface(Vec3f(399.0F, 0.0F, 0.1F), &s));
  EXPECT_FALSE(map.nearest_surface(Vec3f(0.0F, 0.0F, 0.1F), &s));
}

TEST(RollingMap, ForgettingKeepsEveryNearVoxelFindable) {
  // Backward-shift deletion must not break probe sequences: voxels inside the radius stay.
  RollingMapParams params;
  params.radius_m = 30.0;
  params.capacity = 50'000;
  VoxelTable table(0.5, params);
  std::mt19937 rng(8);
  std::uniform_real_distribution<float> u(-60.0F, 60.0F);
  Points patches;  // small dense planes at random positions
  std::vector<Vec3f> places;
  for (int k = 0; k < 3000; ++k) {
    const Vec3f corner(0.5F * std::floor(u(rng) * 2), 0.5F * std::floor(u(rng) * 2), 0.0F);
    places.push_back(corner + Vec3f(0.25F, 0.25F, 0.1F));
    for (int i = 0; i < 5; ++i) {
      for (int j = 0; j < 5; ++j) {
        patches.push_back(corner + Vec3f(0.05F + 0.1F * static_cast<float>(i),
                                         0.05F + 0.1F * static_cast<float>(j), 0.1F));
      }
    }
  }
  table.insert(patches);
  for (int call = 0; call < 17; ++call) table.forget_far(Vec3f::Zero(), 0.0F);
  for (const Vec3f& p : places) {
    SurfaceQuery query{p};
    table.nearest_surfaces(&query, 1);
    if (p.norm() < 29.0F) {
      ASSERT_TRUE(query.found);
    } else if (p.norm() > 32.0F) {
      ASSERT_FALSE(query.found && query.surface.mean.norm() > 31.0F);
    }
  }
}

/// A map that a vehicle made on its way to `places`, and then drove to `back` without seeing
/// ground.
class WayBack {
 public:
  explicit WayBack(int archive) : map_(params(archive)) {}

  void drive_out(const std::vector<Vec3>& places) {
    for (const Vec3& p : places) {
      map_.insert(test::scene(test::Ground::kFlat, false, 3000, 0.01, Vec3::Zero(), &rng_),
                  Pose{Quat::Identity(), p});
    }
  }
  void drive_blind(const std::vector<Vec3>& places) {
    for (const Vec3& p : places) map_.insert(Points{}, Pose{Quat::Identity(), p});
  }
  [[nodiscard]] bool sees_ground(const Vec3& p) {
    Surface s{};
    return map_.nearest_surface((p + Vec3(0.0, 0.0, 0.1)).cast<float>(), &s);
  }
  [[nodiscard]] const RollingMap& map() const { return map_; }

 private:
  static RollingMapParams params(int archive) {
    RollingMapParams p;
    p.radius_m = 60.0;
    p.archive = archive;
    return p;
  }

  std::mt19937 rng_{5};
  RollingMap map_;
};

std::vector<Vec3> straight(double from_m, double to_m) {
  std::vector<Vec3> places;
  const double step_m = from_m < to_m ? 1.0 : -1.0;
  for (double x = from_m; (to_m - x) * step_m >= 0.0; x += step_m) places.emplace_back(x, 0.0, 0.0);
  return places;
}

TEST(RollingMap, TheMapOfTheWayOutIsThereOnTheWayBack) {
  WayBack with(200'000);
  WayBack without(0);
  for (WayBack* w : {&with, &without}) {
    w->drive_out(straight(0.0, 400.0));
    ASSERT_FALSE(w->sees_ground(Vec3(0.0, 0.0, 0.0)));
    w->drive_blind(straight(400.0, 0.0));
  }
  for (double x = 0.0; x < 40.0; x += 5.0) {
    EXPECT_TRUE(with.sees_ground(Vec3(x, 1.0, 0.0))) << x;
    EXPECT_FALSE(without.sees_ground(Vec3(x, 1.0, 0.0))) << x;
  }
}

TEST(RollingMap, AfterALoopTheOldMapDoesNotReturn) {
  // Its position relative to the vehicle has drifted over the whole loop.
  WayBack w(200'000);
  std::vector<Vec3> loop;
  for (double a = 0.0; a < 6.3; a += 0.01) {
    loop.emplace_back(120.0 * std::sin(a), 120.0 * (1.0 - std::cos(a)), 0.0);
  }
  w.drive_out({loop.begin(), loop.begin() + 200});
  w.drive_blind({loop.begin() + 200, loop.end()});
  w.drive_blind(straight(0.0, 40.0));
  EXPECT_FALSE(w.sees_ground(Vec3(20.0, 1.0, 0.0)));
  EXPECT_GT(w.map().archived(), 10'000U);
}

TEST(RollingMap, NothingReturnsWhereTheVehicleDidNotDrive) {
  WayBack w(200'000);
  w.drive_out(straight(0.0, 400.0));
  std::vector<Vec3> beside;
  for (const Vec3& p : straight(400.0, 0.0)) beside.emplace_back(p.x(), 20.0, 0.0);
  w.drive_blind(beside);
  EXPECT_FALSE(w.sees_ground(Vec3(0.0, 1.0, 0.0)));
}

TEST(RollingMap, AFullArchiveKeepsTheNewestPart) {
  WayBack w(20'000);
  w.drive_out(straight(0.0, 600.0));
  EXPECT_LE(w.map().archived(), 40'000U);
  w.drive_blind(straight(600.0, 0.0));
  EXPECT_FALSE(w.sees_ground(Vec3(0.0, 1.0, 0.0)));
}

}  // namespace
}  // namespace rcs::registration

#include "rcs/terrain/surface_points.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/terrain/map_scene.h"

namespace rcs {
namespace {

std::vector<SurfacePoint> example(std::size_t n) {
  return test::random_points(1, test::random_raster(1, {0, 0}, 8, 8), n);
}

TEST(SurfaceIndex, FindsTheClosestPointWithinADistanceOnly) {
  const std::vector<SurfacePoint> points = example(500);
  SurfaceIndex index;
  EXPECT_EQ(index.closest_within(Vec3f::Zero(), 100.0F), nullptr) << "nothing is loaded";
  index.load(points);
  for (const SurfacePoint& query : example(600)) {
    const Vec3f p = query.p_m + Vec3f(0.3F, -0.2F, 0.5F);
    const auto farther = [&](const SurfacePoint& a, const SurfacePoint& b) {
      return (a.p_m - p).norm() < (b.p_m - p).norm();
    };
    const SurfacePoint nearest = *std::min_element(points.begin(), points.end(), farther);
    const float at = (nearest.p_m - p).norm();
    const SurfacePoint* found = index.closest_within(p, 1.001F * at);
    ASSERT_NE(found, nullptr);
    EXPECT_EQ((found->p_m - p).norm(), at);
    EXPECT_EQ(index.closest_within(p, 0.999F * at), nullptr);
  }
  index.load({});
  EXPECT_EQ(index.closest_within(Vec3f::Zero(), 100.0F), nullptr);
}

TEST(SurfacePoints, ThinningLeavesOnePointPerCubeUpToALimit) {
  const std::vector<SurfacePoint> points = example(5000);
  EXPECT_EQ(thinned(points, 1e-4, 5000).size(), 5000U);
  const std::vector<SurfacePoint> few = thinned(points, 0.1, 200);
  EXPECT_LE(few.size(), 200U);
  EXPECT_GT(few.size(), 200U / 10);
  EXPECT_TRUE(few == thinned(points, 0.1, 200));
  EXPECT_TRUE(few.front() == points.front());
}

}  // namespace
}  // namespace rcs

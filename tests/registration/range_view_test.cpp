#include "modules/registration/range_view.h"

#include <gtest/gtest.h>

namespace rcs::registration {
namespace {

/// A sphere of points around the sensor, but for the half below it.
Points dome(float radius_m) {
  Points points;
  for (int i = 0; i < 360; ++i) {
    for (int k = 0; k < 90; ++k) {
      const auto azimuth = static_cast<float>(radians(i));
      const auto elevation = static_cast<float>(radians(k));
      points.push_back(radius_m * Vec3f(std::cos(elevation) * std::cos(azimuth),
                                        std::cos(elevation) * std::sin(azimuth),
                                        std::sin(elevation)));
    }
  }
  return points;
}

TEST(RangeView, OnlyWhatIsClearlyInFrontOfAllReturnsIsSeenThrough) {
  const RangeView view(dome(10.0F));
  for (const Vec3f& direction :
       {Vec3f(1, 0, 0), Vec3f(-1, 0, 0), Vec3f(0, 1, 0), Vec3f(0, -1, 0), Vec3f(0, 0, 1),
        Vec3f(0.6F, 0.6F, 0.5F), Vec3f(-0.7F, 0.1F, 0.7F)}) {
    const Vec3f d = direction.normalized();
    EXPECT_TRUE(view.passed_through(1.0F * d)) << d.transpose();
    EXPECT_TRUE(view.passed_through(9.0F * d)) << d.transpose();
    EXPECT_FALSE(view.passed_through(9.8F * d)) << "within the noise";
    EXPECT_FALSE(view.passed_through(12.0F * d)) << "hidden";
  }
}

TEST(RangeView, NothingIsKnownWhereThereIsNoReturn) {
  const RangeView view(dome(10.0F));
  EXPECT_FALSE(view.passed_through(Vec3f(0.0F, 0.0F, -3.0F)));
  EXPECT_FALSE(view.passed_through(Vec3f(2.0F, 1.0F, -3.0F)));
  EXPECT_FALSE(view.passed_through(Vec3f::Zero())) << "no direction";
  EXPECT_FALSE(RangeView(Points{}).passed_through(Vec3f(1.0F, 0.0F, 0.0F)));
}

TEST(RangeView, TheNearestReturnOfADirectionCounts) {
  Points points = dome(30.0F);
  points.push_back(Vec3f(5.0F, 0.0F, 0.0F));
  const RangeView view(points);
  EXPECT_FALSE(view.passed_through(Vec3f(10.0F, 0.0F, 0.0F)))
      << "a pole may hide it or be beside it";
  EXPECT_TRUE(view.passed_through(Vec3f(0.0F, 10.0F, 0.0F)));
}

}  // namespace
}  // namespace rcs::registration

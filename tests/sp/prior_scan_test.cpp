// The part of a scan that is matched to the a priori map.
#include "modules/sp/prior/prior_scan.h"

#include <gtest/gtest.h>

#include <cstddef>

namespace rcs::sp {
namespace {

// Level ground of 20 x 20 m, 0.25 m apart, and a post in its middle.
Points scene() {
  Points points;
  for (int i = -40; i < 40; ++i) {
    for (int j = -40; j < 40; ++j) {
      points.push_back(Vec3(0.25 * i + 0.1, 0.25 * j + 0.1, 0.0).cast<float>());
    }
  }
  for (int k = 0; k < 60; ++k) points.push_back(Vec3(0.05, 0.05, 0.05 * k).cast<float>());
  return points;
}

TEST(PriorScan, SeparatesTheGroundFromStructure) {
  PriorScan scan;
  scan.take(scene(), Vec3::UnitZ(), 1000, {});
  EXPECT_EQ(scan.ground().size(), 100U);  // columns of 2 m
  for (std::size_t i = 0; i < scan.ground().size(); ++i) EXPECT_EQ(scan.ground()[i].z(), 0.0F);
  EXPECT_EQ(scan.standing().size(), 10U);  // 0.5 to 3 m, one each 0.25 m
  for (std::size_t i = 0; i < scan.standing().size(); ++i) EXPECT_GT(scan.standing()[i].z(), 0.5F);
}

TEST(PriorScan, KeepsAFewStructurePointsSpreadOverTheScan) {
  PriorScan scan;
  scan.take(scene(), Vec3::UnitZ(), 3, {});
  ASSERT_EQ(scan.standing().size(), 3U);
  EXPECT_GT(scan.standing()[2].z() - scan.standing()[0].z(), 1.0F);
  scan.take(scene(), Vec3::UnitZ(), 0, {});
  EXPECT_TRUE(scan.standing().empty());
  EXPECT_EQ(scan.ground().size(), 100U);
}

TEST(PriorScan, UsesTheGivenUpDirection) {
  // The vehicle lies on its side.
  const Quat turned = Quat::FromTwoVectors(Vec3::UnitZ(), Vec3::UnitY());
  Points points;
  const Points upright = scene();
  for (std::size_t i = 0; i < upright.size(); ++i) {
    points.push_back((turned * upright[i].cast<double>()).cast<float>());
  }
  PriorScan scan;
  scan.take(points, Vec3::UnitY(), 1000, {});
  EXPECT_NEAR(static_cast<double>(scan.ground().size()), 100.0, 25.0);
  EXPECT_NEAR(static_cast<double>(scan.standing().size()), 10.0, 2.0);
}

}  // namespace
}  // namespace rcs::sp

#include "modules/sp/voxel_scale.h"

#include <gtest/gtest.h>

namespace rcs::sp {
namespace {

constexpr double kVoxel_m = 0.5;
constexpr double kHard_m = 0.02;   // sigma of a hard surface
constexpr double kGrass_m = 0.08;  // of grass

TEST(FittingScale, IsThatOfTheConfigurationWhereTheScanIsFar) {
  EXPECT_EQ(fitting_scale(10.0, kVoxel_m, kHard_m), 1.0);
  EXPECT_EQ(fitting_scale(80.0, kVoxel_m, kHard_m), 1.0);
}

TEST(FittingScale, FallsWithTheDistanceDownToTheNoiseOfASurface) {
  EXPECT_NEAR(fitting_scale(4.0, kVoxel_m, kHard_m), 0.24 / kVoxel_m, 1e-12);
  EXPECT_NEAR(fitting_scale(4.0, 1.5, kHard_m), 0.24 / 1.5, 1e-12) << "whatever is configured";
  EXPECT_NEAR(fitting_scale(1.0, kVoxel_m, kHard_m), 0.18 / kVoxel_m, 1e-12);
  EXPECT_EQ(fitting_scale(1.0, 0.7, kGrass_m), 1.0) << "as in config/demo3.toml";
}

TEST(VoxelScale, ChangesOnlyIfAnotherOneSuitsForLong) {
  VoxelScale scale;
  scale.begin(0.4);
  for (int k = 0; k < 100; ++k) EXPECT_FALSE(scale.unsuitable(0.7)) << "less than a factor of two";
  for (int k = 0; k < 19; ++k) EXPECT_FALSE(scale.unsuitable(0.9));
  EXPECT_FALSE(scale.unsuitable(0.5)) << "begins again";
  for (int k = 0; k < 19; ++k) EXPECT_FALSE(scale.unsuitable(0.9));
  EXPECT_TRUE(scale.unsuitable(0.9));
  scale.begin(0.9);
  for (int k = 0; k < 19; ++k) EXPECT_FALSE(scale.unsuitable(0.4));
  EXPECT_TRUE(scale.unsuitable(0.4));
}

TEST(MedianRange, IsThatFromTheLadar) {
  std::vector<float> buffer;
  EXPECT_EQ(median_range_m(Points(), Vec3::Zero(), &buffer), 0.0);
  Points points;
  for (int k = 1; k <= 30001; ++k) points.push_back(Vec3f(1.0F, 0.001F * static_cast<float>(k), 0));
  EXPECT_NEAR(median_range_m(points, Vec3(1.0, 0.0, 0.0), &buffer), 15.0, 0.05);
  EXPECT_LE(buffer.size(), 2001U) << "a cycle does not pass over all points";
}

}  // namespace
}  // namespace rcs::sp

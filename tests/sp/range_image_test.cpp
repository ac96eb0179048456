#include "modules/sp/scan/range_image.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace rcs::sp {
namespace {

LadarParams demo3() {
  LadarParams p;
  p.T_vehicle_mount = {Quat::Identity(), Vec3(0.9, 0.0, 0.9)};
  return p;
}

RangeFacet facet_of(const std::vector<float>& ranges) {
  RangeFacet f;
  f.range_m = ranges.data();
  f.facet_rows = 2;
  f.duration = from_milliseconds(6.25);
  return f;
}

TEST(Ranges, PointsLieInTheDirectionOfTheirCell) {
  const Calibration calibration(demo3());
  std::vector<float> ranges(360, 0.0F);
  ranges[90] = 20.0F;  // row 0, just right of the middle
  Scan scan;
  const ConversionCount count = calibration.append(facet_of(ranges), &scan);
  EXPECT_EQ(count.returns, 1);
  EXPECT_EQ(count.missing, 359);
  ASSERT_EQ(scan.points.size(), 1U);
  const double elevation = radians(-10.0 + 0.5 * 20.0 / 32);
  const double azimuth = radians(45.0 - 90.5 * 0.5);
  const Vec3 expected(0.9 + 20 * std::cos(elevation) * std::cos(azimuth),
                      20 * std::cos(elevation) * std::sin(azimuth), 0.9 + 20 * std::sin(elevation));
  EXPECT_LT((scan.points[0].cast<double>() - expected).norm(), 1e-5);
  EXPECT_EQ(scan.dt_us[0], 3125);
}

TEST(Ranges, TiltUpIsPositiveAndFollowsItsRate) {
  const Calibration calibration(demo3());
  std::vector<float> ranges(360, 0.0F);
  ranges[90] = 10.0F;
  RangeFacet facet = facet_of(ranges);
  facet.tilt_rad = radians(10.0 - 0.5 * 20.0 / 32);  // brings row 0 level
  Scan level;
  calibration.append(facet, &level);
  EXPECT_NEAR(level.points.z[0], 0.9, 1e-4);
  facet.tilt_rate_radps = 1.0;
  Scan rising;
  calibration.append(facet, &rising);
  EXPECT_NEAR(rising.points.z[0], 0.9 + 10.0 * 0.003125, 1e-3);
}

TEST(Ranges, InvalidRangesAreCountedAndNotUsed) {
  const Calibration calibration(demo3());
  std::vector<float> ranges(360, 5.0F);
  ranges[0] = std::numeric_limits<float>::quiet_NaN();
  ranges[1] = std::numeric_limits<float>::infinity();
  ranges[2] = -3.0F;
  ranges[3] = 0.5F;
  ranges[4] = 61.0F;
  ranges[5] = 0.0F;
  Scan scan;
  const ConversionCount count = calibration.append(facet_of(ranges), &scan);
  EXPECT_EQ(count.rejected, 5);
  EXPECT_EQ(count.missing, 1);
  EXPECT_EQ(count.returns, 354);
  EXPECT_EQ(scan.points.size(), 354U);
  EXPECT_EQ(scan.dt_us.size(), 354U);
}

// Points between an object and its background are removed; thin objects stay, since they are seen
// in two rows.
TEST(Ranges, MixedPixelsAreLeftOut) {
  const Calibration calibration(demo3());
  std::vector<float> ranges(360, 20.0F);
  for (std::size_t row = 0; row < 2; ++row) {
    for (std::size_t col = 40; col < 60; ++col) ranges[row * 180 + col] = 5.0F;
    ranges[row * 180 + 100] = 6.0F;  // a trunk, one column wide
  }
  ranges[60] = 12.0F;        // mixed, in row 0 alone
  ranges[180 + 39] = 15.0F;  // the other side, row 1
  Scan scan;
  const ConversionCount count = calibration.append(facet_of(ranges), &scan);
  EXPECT_EQ(count.lone, 2);
  EXPECT_EQ(count.returns, 358);
}

TEST(Ranges, AFacetWithoutReturnsIsValid) {
  const Calibration calibration(demo3());
  Scan scan;
  RangeFacet facet;
  EXPECT_EQ(calibration.append(facet, &scan).returns, 0);
}

TEST(Ranges, CartesianPointsAreMountedAndSanitized) {
  const Calibration calibration(demo3());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<float> x = {10.0F, nan, 0.1F, 1e30F};
  const std::vector<float> y = {0.0F, 0.0F, 0.0F, 0.0F};
  const std::vector<std::int32_t> dt = {100, 200, 300, 400};
  PointFacet facet;
  facet.x_m = x.data();
  facet.y_m = y.data();
  facet.z_m = y.data();
  facet.dt_us = dt.data();
  facet.n = 4;
  facet.start = Duration(1000);
  Scan scan;
  const ConversionCount count = calibration.append(facet, &scan);
  EXPECT_EQ(count.returns, 1);
  EXPECT_EQ(count.rejected, 3);
  EXPECT_FLOAT_EQ(scan.points.x[0], 10.9F);
  EXPECT_EQ(scan.dt_us[0], 1100);
}

}  // namespace
}  // namespace rcs::sp

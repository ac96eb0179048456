#include "tools/survey/point_density.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

namespace rcs::survey {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const Vec2 kLow(0.0, 0.0);
const Vec2 kHigh(200.0, 100.0);

/// Uniform points in the rectangle, without those for which `hole` is true.
template <class Hole>
std::vector<Vec3> points(int n, Hole hole) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> x(0.0, kHigh.x());
  std::uniform_real_distribution<double> y(0.0, kHigh.y());
  std::vector<Vec3> all;
  while (static_cast<int>(all.size()) < n) {
    const Vec3 p(x(rng), y(rng), 100.0 + 1e-3 * static_cast<double>(all.size()));
    if (!hole(p)) all.push_back(p);
  }
  return all;
}

DensityMetrics density_of(const std::vector<Vec3>& all) {
  PointDensity density(kLow, kHigh, static_cast<std::int64_t>(all.size()));
  for (const Vec3& p : all) density.add(p);
  return density.metrics();
}

bool nowhere(const Vec3& /*p*/) { return false; }

TEST(PointDensity, OfUniformPointsIsTheirNumberOverTheArea) {
  const DensityMetrics f = density_of(points(80'000, nowhere));
  EXPECT_NEAR(f.points_per_m2, 4.0, 0.1);
  EXPECT_EQ(f.largest_hole_m2, 0.0);
  EXPECT_EQ(f.duplicate_share, 0.0);
  EXPECT_THAT(density_warnings(f, 1.0, 19'600), IsEmpty());
}

TEST(PointDensity, OfAStripIsThatOfTheStrip) {
  // A tenth of the rectangle: the density is ten times that of the rectangle.
  const DensityMetrics f = density_of(points(80'000, [](const Vec3& p) { return p.y() > 10.0; }));
  EXPECT_NEAR(f.points_per_m2, 40.0, 4.0);
}

TEST(PointDensity, TheCellContainsThreeAndAHalfPointsOnAverage) {
  EXPECT_EQ(cell_of_density(100.0), 0.25);
  EXPECT_EQ(cell_of_density(16.0), 0.5);
  EXPECT_EQ(cell_of_density(4.0), 1.0);
  EXPECT_EQ(cell_of_density(3.4), 2.0);
  EXPECT_EQ(cell_of_density(0.2), 5.0);
  EXPECT_EQ(cell_of_density(1e-9), 100.0);
}

TEST(PointDensity, AnEnclosedHoleIsMeasured) {
  const auto in_lake = [](const Vec3& p) { return (p - Vec3(100.0, 50.0, p.z())).norm() < 20.0; };
  const DensityMetrics f = density_of(points(80'000, in_lake));
  EXPECT_NEAR(f.largest_hole_m2, kPi * 400.0, 0.25 * kPi * 400.0);
  EXPECT_THAT(density_warnings(f, 1.0, 18'500), ElementsAre(HasSubstr("a hole of")));
  // At the border of the survey there is no hole.
  const auto beyond = [](const Vec3& p) { return (p - Vec3(200.0, 50.0, p.z())).norm() < 20.0; };
  EXPECT_EQ(density_of(points(80'000, beyond)).largest_hole_m2, 0.0);
}

TEST(PointDensity, RepeatedPointsAreCountedAlsoBeyondTheSample) {
  // More points than the sample contains; a quarter of the second half is a repetition.
  std::vector<Vec3> all = points(300'000, nowhere);
  const std::vector<Vec3> again(all.begin(), all.begin() + 100'000);
  all.insert(all.end(), again.begin(), again.end());
  const DensityMetrics f = density_of(all);
  EXPECT_NEAR(f.duplicate_share, 0.25, 0.05);
  EXPECT_THAT(density_warnings(f, 1.0, 20'000),
              ElementsAre(HasSubstr("% of the points repeat the coordinates of another")));
}

TEST(PointDensity, ImplausibleSurveysAreReported) {
  DensityMetrics f;
  f.points = 1000;
  f.surveyed_m2 = 10'000.0;
  f.points_per_m2 = 0.1;
  f.lowest_m = 3.0;
  f.highest_m = 4.0;
  EXPECT_THAT(density_warnings(f, 1.0, 900),
              ElementsAre(HasSubstr("0.1 points per cell of 1 m on average: the sigma of a cell "
                                    "cannot be measured; 10 m gives 10"),
                          HasSubstr("heights in 9 % of the surveyed area")));
  f.highest_m = 3.0;
  EXPECT_THAT(density_warnings(f, 10.0, 95), ElementsAre(HasSubstr("all heights are 3 m")));
  f.highest_m = 4.0;
  f.surveyed_m2 = 1.0;
  f.points_per_m2 = 1000.0;
  EXPECT_THAT(density_warnings(f, 0.25, 16), ElementsAre(HasSubstr("check the unit")));
}

}  // namespace
}  // namespace rcs::survey

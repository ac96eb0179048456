#include "sim/terrain/survey_model.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rcs/terrain/elevation_map.h"

namespace rcs::sim {
namespace {

const Geodetic kDatum{radians(40.43), radians(-76.57), {150.0}};
const Region kRegion{{-205.0, -95.0}, {395.0, 305.0}};

Relief hills() { return Relief(8, {{102.4, 3.0}, {25.6, 0.8}, {6.4, 0.15}, {0.8, 0.03}}, {}); }

PriorMapParams exact() {
  PriorMapParams p;
  p.sigma_m = 1e-6;
  p.bias_sigma_m = 0.0;
  return p;
}

TEST(PriorMap, IsTheBlockMeanOfTheGround) {
  const Relief relief = hills();
  const Raster map = make_prior_map(relief, kDatum, kRegion, exact(), 1).raster;
  EXPECT_EQ(map.first, (Cell{-21, -10}));  // on whole cells
  EXPECT_EQ(map.level.origin_m, Vec2(0.0, 0.0));
  for (const int cell : {0, 777, 1500}) {
    const int i = cell % map.width;
    const int j = cell / map.width;
    double sum = 0.0;
    const int side = 100;
    for (int b = 0; b < side; ++b) {
      for (int a = 0; a < side; ++a) {
        sum += relief.height(10.0 * (map.first.i + i + (a + 0.5) / side),
                             10.0 * (map.first.j + j + (b + 0.5) / side));
      }
    }
    EXPECT_NEAR(map.z_m[static_cast<std::size_t>(cell)], sum / (side * side), 0.02);
  }
}

TEST(PriorMap, ErrorsHaveTheStatedSizes) {
  const Relief relief = hills();
  const Raster truth = make_prior_map(relief, kDatum, kRegion, exact(), 1).raster;
  PriorMapParams params;
  params.sigma_m = 0.3;
  params.bias_sigma_m = 0.5;
  params.bias_correlation_m = 100.0;
  double squares = 0.0;
  double white = 0.0;
  int n = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const Raster map = make_prior_map(relief, kDatum, kRegion, params, seed).raster;
    for (std::size_t k = 0; k + 1 < map.z_m.size(); ++k, ++n) {
      const double e = map.z_m[k] - truth.z_m[k];
      const double next = map.z_m[k + 1] - truth.z_m[k + 1];
      squares += e * e;
      white += 0.5 * (e - next) * (e - next);
    }
  }
  EXPECT_NEAR(std::sqrt(squares / n), std::hypot(0.3, 0.5), 0.04);
  EXPECT_NEAR(std::sqrt(white / n), 0.3, 0.02);  // the bias hardly changes from cell to cell
}

TEST(PriorMap, SigmaCoversTheGround) {
  const Relief relief = hills();
  PriorMapParams params;
  params.bias_sigma_m = 0.0;
  const PriorMap survey = make_prior_map(relief, kDatum, kRegion, params, 4);
  const Result<ElevationMap> map = ElevationMap::from_rasters(survey.frame, {survey.raster});
  ASSERT_TRUE(map);
  double squares = 0.0;
  int n = 0;
  for (double y = -80.0; y < 280.0; y += 3.7) {
    for (double x = -190.0; x < 380.0; x += 3.7, ++n) {
      Elevation e;
      ASSERT_TRUE(map->sample(x, y, &e));
      squares += std::pow((relief.height(x, y) - e.z_m) / e.sigma_m, 2);
    }
  }
  // Below 1 because interpolation averages the white part.
  EXPECT_GT(squares / n, 0.4);
  EXPECT_LT(squares / n, 1.1);
}

}  // namespace
}  // namespace rcs::sim

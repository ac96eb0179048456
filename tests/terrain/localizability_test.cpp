#include "rcs/terrain/localizability.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "tests/terrain/map_scene.h"

namespace rcs {
namespace {

// 600 m a side about the origin, cells of 2 m, NaN unknown.
ElevationMap ground(const std::function<double(double, double)>& z, float sigma_m = 0.2F) {
  Raster raster;
  raster.level.cell_m = 2.0;
  raster.first = {-150, -150};
  raster.width = raster.height = 300;
  raster.sigma_m = {sigma_m};
  for (int j = 0; j < raster.height; ++j) {
    for (int i = 0; i < raster.width; ++i) {
      const Vec2 p = raster.level.centre({raster.first.i + i, raster.first.j + j});
      raster.z_m.push_back(static_cast<float>(z(p.x(), p.y())));
    }
  }
  Result<ElevationMap> map = ElevationMap::from_rasters(test::frame(), {raster});
  EXPECT_TRUE(map) << map.error().message;
  return std::move(*map);
}

TEST(Localizability, APlaneGivesNoInformation) {
  const ElevationMap map = ground([](double x, double y) { return 0.2 * x - 0.1 * y; });
  const Eigen::Matrix2d information = terrain_information(map, {3.0, 4.0}, {});
  // The remaining information comes from gravity, which separates the slope of the plane from that
  // of the vehicle.
  EXPECT_GT(worst_sigma_m(information), 1.0e3);
}

TEST(Localizability, ARidgeGivesInformationAcrossItsAxisOnly) {
  const ElevationMap map = ground([](double x, double) { return 3.0 * std::sin(0.2 * x); });
  const Eigen::Matrix2d information = terrain_information(map, {0.0, 0.0}, {});
  EXPECT_LT(1.0 / std::sqrt(information(0, 0)), 0.05);
  EXPECT_GT(worst_sigma_m(information), 1.0e3);
}

TEST(Localizability, HillsGiveInformationInBothAxesByTheSigmaOfTheMap) {
  const auto hills = [](double x, double y) {
    return 3.0 * std::sin(0.2 * x) * std::cos(0.15 * y);
  };
  const double fine = worst_sigma_m(terrain_information(ground(hills, 0.2F), {10, 5}, {}));
  const double poor = worst_sigma_m(terrain_information(ground(hills, 2.0F), {10, 5}, {}));
  EXPECT_LT(fine, 0.1);
  EXPECT_GT(poor, 5.0 * fine);
}

// A survey with errors of 0.3 m in each cell of 2 m: the slopes of the errors, 0.17, tell nothing.
TEST(Localizability, ErrorsOfTheHeightsAreNoRelief) {
  std::mt19937 rng(3);
  std::normal_distribution<> error(0.0, 0.3);
  const ElevationMap lake = ground([&](double, double) { return error(rng); }, 0.3F);
  const ElevationMap hills = ground(
      [&](double x, double y) { return 3.0 * std::sin(0.2 * x) * std::cos(0.15 * y) + error(rng); },
      0.3F);
  for (const Vec2& place : {Vec2(0.0, 0.0), Vec2(80.0, -40.0), Vec2(-120.0, 150.0)}) {
    EXPECT_GT(worst_sigma_m(terrain_information(lake, place, {})), 1.0);
    EXPECT_LT(worst_sigma_m(terrain_information(hills, place, {})), 0.2);
  }
}

TEST(Localizability, UnknownGroundGivesNoInformation) {
  const ElevationMap map = ground([](double x, double) { return x > 100.0 ? std::nan("") : 0.0; });
  EXPECT_TRUE(terrain_information(map, {200.0, 0.0}, {}).isZero());
  EXPECT_TRUE(std::isinf(worst_sigma_m(terrain_information(map, {1e5, 0.0}, {}))));
}

TEST(Localizability, AlongAPathUncertaintyGrowsOnFlatGroundAndIsBoundedOnHills) {
  const auto half = [](double x, double y) {
    return x < 0.0 ? 0.0 : 3.0 * std::sin(0.2 * x) * std::cos(0.15 * y);
  };
  const DeadReckoning motion{0.3, 0.01};
  const auto along =
      path_uncertainty_along(ground(half), {{-250, 0}, {-50, 0}, {250, 0}}, motion, {});
  ASSERT_EQ(along.size(), 21U);
  EXPECT_DOUBLE_EQ(along.back().travelled_m, 500.0);
  EXPECT_NEAR(along.back().sigma_dead_reckoning_m, std::hypot(0.3, 5.0), 1e-6);
  EXPECT_NEAR(along[7].place_m.x(), -75.0, 1e-9);
  EXPECT_NEAR(along[7].sigma_with_map_m, along[7].sigma_dead_reckoning_m, 0.01);
  EXPECT_GT(along[7].sigma_with_map_m, 1.5);
  EXPECT_LT(along.back().sigma_with_map_m, 0.1);
}

}  // namespace
}  // namespace rcs

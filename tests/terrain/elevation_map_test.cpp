#include "rcs/terrain/elevation_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <random>

namespace rcs {
namespace {

ElevationTile random_tile(std::int64_t id, double x_m, double y_m, int width, int height) {
  ElevationTile t;
  t.id = id;
  t.datum = {radians(40.43), radians(-76.57), {150.0}};
  t.origin_world_m = {x_m, y_m};
  t.cell_m = 2.5;
  t.width = width;
  t.height = height;
  std::mt19937 rng(static_cast<unsigned>(id));
  std::normal_distribution<float> normal(10.0F, 3.0F);
  for (int i = 0; i < width * height; ++i) t.z_world_m.push_back(normal(rng));
  t.sigma_m = 0.3;
  t.bias_sigma_m = 0.5;
  t.bias_correlation_m = 500.0;
  return t;
}

ElevationMap map_of(const std::vector<ElevationTile>& tiles) {
  Result<ElevationMap> map = ElevationMap::from_tiles(tiles);
  EXPECT_TRUE(map) << map.error().message;
  return std::move(*map);
}

TEST(ElevationMap, InterpolatesItsNodes) {
  const ElevationTile t = random_tile(1, -30.0, 20.0, 9, 7);
  const ElevationMap map = map_of({t});
  for (int j = 0; j < t.height; ++j) {
    for (int i = 0; i < t.width; ++i) {
      Elevation e;
      ASSERT_TRUE(map.sample(-30.0 + 2.5 * (i + 0.5), 20.0 + 2.5 * (j + 0.5), &e));
      EXPECT_NEAR(e.z_m, t.z_world_m[static_cast<std::size_t>(j * t.width + i)], 1e-12);
      EXPECT_NEAR(e.sigma_m, 0.3, 1e-7);  // stored as float
      EXPECT_EQ(e.tile_id, 1);
    }
  }
}

TEST(ElevationMap, GradientIsTheSlopeOfTheSurface) {
  const ElevationMap map = map_of({random_tile(2, 0.0, 0.0, 12, 12)});
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> uniform(3.0, 27.0);
  const double h = 1e-6;
  for (int k = 0; k < 200; ++k) {
    const double x = uniform(rng);
    const double y = uniform(rng);
    Elevation e, east, west, north, south;
    ASSERT_TRUE(map.sample(x, y, &e) && map.sample(x + h, y, &east) &&
                map.sample(x - h, y, &west) && map.sample(x, y + h, &north) &&
                map.sample(x, y - h, &south));
    // 2e-8: rounding of a height over the step.
    EXPECT_NEAR(e.gradient.x(), (east.z_m - west.z_m) / (2 * h), 2e-8);
    EXPECT_NEAR(e.gradient.y(), (north.z_m - south.z_m) / (2 * h), 2e-8);
  }
}

TEST(ElevationMap, TilesSplitAnywhereAreTheSameSurface) {
  const ElevationTile whole = random_tile(3, 5.0, 5.0, 10, 4);
  ElevationTile west = whole;
  ElevationTile east = whole;
  west.id = 31;
  east.id = 32;
  west.width = 6;
  east.width = 4;
  east.origin_world_m.x() += 6 * whole.cell_m;
  west.z_world_m.clear();
  east.z_world_m.clear();
  for (std::size_t j = 0; j < 4; ++j) {
    for (std::size_t i = 0; i < 10; ++i) {
      (i < 6 ? west : east).z_world_m.push_back(whole.z_world_m[j * 10 + i]);
    }
  }
  const ElevationMap one = map_of({whole});
  const ElevationMap two = map_of({east, west});
  std::mt19937 rng(2);
  std::uniform_real_distribution<double> x_m(6.25, 28.75);
  std::uniform_real_distribution<double> y_m(6.25, 13.75);
  for (int k = 0; k < 500; ++k) {
    const double x = x_m(rng);
    const double y = y_m(rng);
    Elevation a, b;
    ASSERT_TRUE(one.sample(x, y, &a) && two.sample(x, y, &b));
    EXPECT_EQ(a.z_m, b.z_m);
    EXPECT_EQ(b.tile_id, x < 20.0 ? 31 : 32);
  }
}

TEST(ElevationMap, OutsideAndUnknownAreSaid) {
  ElevationTile t = random_tile(4, 0.0, 0.0, 5, 5);
  t.z_world_m[12] = std::numeric_limits<float>::quiet_NaN();  // the middle cell, at (6.25, 6.25)
  const ElevationMap map = map_of({t});
  Elevation e;
  e.z_m = -77.0;
  EXPECT_FALSE(map.sample(5.0, 5.0, &e));
  EXPECT_FALSE(map.sample(-1.0, 5.0, &e));
  EXPECT_FALSE(map.sample(1.2, 5.0, &e));  // between the border and the first centre
  EXPECT_FALSE(map.sample(5.0, 1e9, &e));
  EXPECT_FALSE(map.sample(std::numeric_limits<double>::quiet_NaN(), 2.0, &e));
  EXPECT_EQ(e.z_m, -77.0);
  EXPECT_TRUE(map.sample(1.25, 1.25, &e));
  EXPECT_TRUE(map.sample(11.25, 11.25, &e));
}

TEST(ElevationMap, CellsAreWhereTheTileSays) {
  const ElevationMap map = map_of({random_tile(5, -30.0, 20.0, 4, 4)});
  EXPECT_EQ(map.cell_at(-30.0, 20.0), (Cell{0, 0}));
  EXPECT_EQ(map.cell_at(-25.1, 24.9), (Cell{1, 1}));
  EXPECT_EQ(map.cell_at(-30.1, 20.0), (Cell{-1, 0}));
}

TEST(ElevationMap, TilesThatDoNotBelongTogetherAreRefused) {
  const ElevationTile a = random_tile(6, 0.0, 0.0, 4, 4);
  ElevationTile off_lattice = random_tile(7, 11.0, 0.0, 4, 4);
  EXPECT_FALSE(ElevationMap::from_tiles({a, off_lattice}));
  ElevationTile other_datum = random_tile(8, 10.0, 0.0, 4, 4);
  other_datum.datum.height.m += 34.0;
  EXPECT_FALSE(ElevationMap::from_tiles({a, other_datum}));
  EXPECT_FALSE(ElevationMap::from_tiles({a, random_tile(9, 1e6, 1e6, 4, 4)}));
  EXPECT_FALSE(ElevationMap::from_tiles({}));
}

TEST(ElevationMap, LoadsDirectories) {
  const std::string dir = testing::TempDir() + "rcs_elevation_map_test";
  std::filesystem::create_directories(dir);
  EXPECT_FALSE(ElevationMap::load(dir));  // nothing in it
  ASSERT_TRUE(write_tile(random_tile(10, 0.0, 0.0, 4, 4), dir + "/a.tile"));
  ASSERT_TRUE(write_tile(random_tile(11, 10.0, 0.0, 4, 4), dir + "/b.tile"));
  const Result<ElevationMap> map = ElevationMap::load(dir);
  ASSERT_TRUE(map) << map.error().message;
  Elevation e;
  EXPECT_TRUE(map->sample(10.0, 5.0, &e));
  EXPECT_EQ(map->bias_sigma_m(), 0.5);
  std::filesystem::remove_all(dir);
  EXPECT_FALSE(ElevationMap::load(dir));
}

}  // namespace
}  // namespace rcs

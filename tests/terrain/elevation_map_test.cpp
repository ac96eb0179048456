#include "rcs/terrain/elevation_map.h"

#include <gtest/gtest.h>

#include <deque>
#include <filesystem>
#include <optional>
#include <random>

#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"
#include "tests/terrain/map_scene.h"
#include "tools/mapping/map_writer.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

ElevationMap map_of(const std::vector<Raster>& rasters) {
  Result<ElevationMap> map = ElevationMap::from_rasters(test::frame(), rasters);
  EXPECT_TRUE(map) << map.error().message;
  return std::move(*map);
}

TEST(ElevationMap, InterpolatesItsNodes) {
  const Raster r = test::random_raster(1, {-260, 250}, 12, 12);
  const ElevationMap map = map_of({r});
  for (int j = 0; j < 11; ++j) {
    for (int i = 0; i < 11; ++i) {
      const Cell c{-260 + i, 250 + j};
      const Vec2 p = r.level.centre(c);
      Elevation e;
      ASSERT_TRUE(map.sample(p.x() + 1e-9, p.y() + 1e-9, &e));
      EXPECT_NEAR(e.z_m, r.z_m[r.at(c)], 1e-7);
      EXPECT_NEAR(e.sigma_m, 0.3, 1e-7);  // stored as float
      EXPECT_EQ(e.cell, c);
      EXPECT_EQ(e.tile_id, tile_id(0, tile_of(c)));
    }
  }
}

TEST(ElevationMap, GradientIsTheSlopeOfTheSurface) {
  const Raster r = test::random_raster(2, {250, -6}, 12, 12);  // across tiles
  const ElevationMap map = map_of({r});
  const Vec2 low = r.level.centre(r.first);
  std::mt19937 rng(1);
  std::uniform_real_distribution<double> uniform(1.0, 26.0);
  const double h = 1e-6;
  for (int k = 0; k < 200; ++k) {
    const double x = low.x() + uniform(rng);
    const double y = low.y() + uniform(rng);
    Elevation e, east, west, north, south;
    ASSERT_TRUE(map.sample(x, y, &e) && map.sample(x + h, y, &east) &&
                map.sample(x - h, y, &west) && map.sample(x, y + h, &north) &&
                map.sample(x, y - h, &south));
    // 2e-8: rounding of a height over the step, with coordinates of some hundred metres.
    EXPECT_NEAR(e.gradient.x(), (east.z_m - west.z_m) / (2 * h), 2e-7);
    EXPECT_NEAR(e.gradient.y(), (north.z_m - south.z_m) / (2 * h), 2e-7);
  }
}

TEST(ElevationMap, OutsideAndUnknownCellsAreReported) {
  Raster r = test::random_raster(4, {0, 0}, 5, 5);
  r.level = MapLevel{2.5, Vec2::Zero(), 0.0, 1.0};
  r.z_m[12] = std::numeric_limits<float>::quiet_NaN();  // the middle cell, at (6.25, 6.25)
  const ElevationMap map = map_of({r});
  Elevation e;
  e.z_m = -77.0;
  EXPECT_FALSE(map.sample(5.0, 5.0, &e));
  EXPECT_FALSE(map.sample(-1.0, 5.0, &e));
  EXPECT_FALSE(map.sample(1.2, 5.0, &e));  // between the border and the first centre
  EXPECT_FALSE(map.sample(5.0, 1e12, &e));
  EXPECT_FALSE(map.sample(std::numeric_limits<double>::quiet_NaN(), 2.0, &e));
  EXPECT_EQ(e.z_m, -77.0);
  EXPECT_TRUE(map.sample(1.26, 1.26, &e));
  EXPECT_TRUE(map.sample(11.24, 11.24, &e));
}

TEST(ElevationMap, TheFinestKnownLevelIsUsed) {
  Raster coarse = test::hills({10.0, Vec2::Zero(), 0.0, 1.0}, {-20, -20}, 40, 40);
  Raster fine = test::hills({0.5, Vec2::Zero(), 0.0, 1.0}, {0, 0}, 60, 60);
  const ElevationMap map = map_of({coarse, fine});
  Elevation e;
  ASSERT_TRUE(map.sample(10.0, 10.0, &e));
  EXPECT_EQ(e.level, 0);
  ASSERT_TRUE(map.sample(50.0, 10.0, &e));
  EXPECT_EQ(e.level, 1);
  EXPECT_EQ(map.level(1).cell_m, 10.0);
}

TEST(ElevationMap, RastersOfOneLevelAreOneSurface) {
  const Raster whole = test::random_raster(3, {2, 2}, 10, 4);
  const ElevationMap one = map_of({whole});
  const ElevationMap two = map_of({cut(whole, {8, 2}, 4, 4), cut(whole, {2, 2}, 6, 4)});
  std::mt19937 rng(2);
  const Vec2 low = whole.level.centre({2, 2});
  std::uniform_real_distribution<double> x_m(0.1, 22.0);
  std::uniform_real_distribution<double> y_m(0.1, 7.0);
  for (int k = 0; k < 500; ++k) {
    const Vec2 p = low + Vec2(x_m(rng), y_m(rng));
    Elevation a, b;
    ASSERT_TRUE(one.sample(p.x(), p.y(), &a) && two.sample(p.x(), p.y(), &b));
    EXPECT_EQ(a.z_m, b.z_m);
  }
  Raster far = whole;
  far.first = {1 << 28, 0};
  EXPECT_FALSE(ElevationMap::from_rasters(test::frame(), {whole, far}));
  EXPECT_FALSE(ElevationMap::from_rasters(test::frame(), {}));
}

/// The closest point of all by exhaustive search.
std::optional<double> closest_of(const Raster& r, const Vec3& p) {
  std::optional<double> nearest_m;
  const Vec2 corner = r.level.origin_m + r.level.cell_m * Vec2(r.first.i, r.first.j);
  for (const SurfacePoint& s : r.points) {
    const Vec3 at = s.p_m.cast<double>() + Vec3(corner.x(), corner.y(), 0.0);
    nearest_m = std::min(nearest_m.value_or(1e9), (at - p).norm());
  }
  return nearest_m;
}

TEST(ElevationMap, TheClosestPointIsFoundAcrossTheBordersOfTiles) {
  Raster r = test::random_raster(3, {-40, -40}, 80, 80);  // four tiles
  r.points = test::random_points(7, r, 4000);
  const ElevationMap map = map_of({r});
  ASSERT_TRUE(map.has_points());
  EXPECT_FALSE(map_of({test::random_raster(3, {0, 0}, 8, 8)}).has_points());
  std::mt19937 rng(4);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  constexpr double kWithin_m = 6.0;
  int found = 0;
  for (int k = 0; k < 1000; ++k) {
    // The tiles meet at the lattice's origin.
    const Vec3 p = Vec3(10.0, -5.0, 5.0) + Vec3(20.0 * u(rng), 20.0 * u(rng), 8.0 * u(rng));
    const double nearest_m = *closest_of(r, p);
    StandingHere here;
    ASSERT_EQ(map.closest_point(p, kWithin_m, &here), nearest_m < kWithin_m) << nearest_m;
    if (nearest_m >= kWithin_m) continue;
    ++found;
    EXPECT_NEAR((here.p_m - p).norm(), nearest_m, 1e-4);
  }
  EXPECT_GT(found, 300);
  StandingHere here;
  EXPECT_FALSE(map.closest_point(Vec3(std::nan(""), 0.0, 0.0), 1.0, &here));
  EXPECT_FALSE(map.closest_point(Vec3(1e12, 0.0, 0.0), 1.0, &here));
}

/// Simulates reading in another thread: a job is finished when the test calls for it.
class SlowLoader final : public TileLoader {
 public:
  SlowLoader(std::string map, std::size_t most) : map_(std::move(map)), max_(most) {}
  bool start(const TileJob& job) override {
    if (under_way_.size() + done_.size() >= max_) return false;
    under_way_.push_back(job);
    return true;
  }
  bool finished(TileJob* job) override {
    if (done_.empty()) return false;
    *job = done_.front();
    done_.pop_front();
    return true;
  }
  void work() {
    if (under_way_.empty()) return;
    load_tile(map_, &buffer_, &under_way_.front());
    done_.push_back(under_way_.front());
    under_way_.pop_front();
  }
  [[nodiscard]] std::size_t under_way() const { return under_way_.size(); }

 private:
  std::string map_;
  std::size_t max_;
  std::vector<std::uint8_t> buffer_;
  std::deque<TileJob> under_way_, done_;
};

class MapOnDisk : public testing::Test {
 protected:
  MapOnDisk()
      : path_(testing::TempDir() + "rcs_elevation_map_" +
              testing::UnitTest::GetInstance()->current_test_info()->name()),
        raster_(test::hills({0.5, Vec2::Zero(), 0.0, 1.0}, {-256, -256}, 3072, 512)) {
    fs::remove_all(path_);
    EXPECT_TRUE(mapping::write_map(path_, test::frame(), raster_));
  }
  ~MapOnDisk() override { fs::remove_all(path_); }

  ElevationMap opened(double radius_m) {
    Result<ElevationMap> map = ElevationMap::open(path_, {radius_m, 64e6});
    EXPECT_TRUE(map) << map.error().message;
    return std::move(*map);
  }
  std::string path_;
  Raster raster_;
};

TEST_F(MapOnDisk, TheLoadedWindowIsTheSameSurfaceAsTheWholeMap) {
  Result<ElevationMap> whole = ElevationMap::load(path_, 1e9);
  ASSERT_TRUE(whole) << whole.error().message;
  ElevationMap map = opened(60.0);
  EXPECT_LT(map.memory_bytes(), whole->memory_bytes());
  const std::size_t before = map.memory_bytes();
  DirectTileLoader loader(path_);
  for (double x = -100.0; x < 1300.0; x += 7.0) {
    map.follow({x, 3.0}, &loader);
    EXPECT_TRUE(map.complete());
    for (const double dx : {-59.0, 0.3, 59.0}) {
      Elevation a, b;
      const bool known = whole->sample(x + dx, 3.0, &a);
      ASSERT_EQ(known, map.sample(x + dx, 3.0, &b)) << x;
      if (known) {
        EXPECT_EQ(a.z_m, b.z_m);
      }
    }
  }
  EXPECT_EQ(map.memory_bytes(), before);
  EXPECT_EQ(map.loading().failed, 0);
}

// A path of 13 km across more than a hundred tiles.
TEST_F(MapOnDisk, MemoryStaysBoundedAcrossAHundredTiles) {
  const Raster strip = test::hills({0.5, Vec2::Zero(), 0.0, 1.0}, {0, 0}, 104 * kTileSide, 64);
  fs::remove_all(path_);
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), strip));
  ElevationMap map = opened(60.0);
  const std::size_t before = map.memory_bytes();
  SlowLoader loader(path_, 3);
  const auto arrive = [&](double x) {
    for (int cycle = 0; cycle < 1000; ++cycle) {
      map.follow({x, 16.0}, &loader);
      if (map.complete()) return;
      loader.work();
    }
  };
  for (double x = 0.0; x < 104 * kTileSide * 0.5; x += 10.0) arrive(x);
  EXPECT_GE(map.loading().loaded, 104);
  EXPECT_EQ(map.loading().failed, 0);
  EXPECT_EQ(map.memory_bytes(), before);
}

TEST_F(MapOnDisk, OnlyTilesBeingLoadedAreUnknown) {
  ElevationMap map = opened(60.0);
  SlowLoader loader(path_, 3);
  Elevation e;
  map.follow({0.0, 0.0}, &loader);
  EXPECT_FALSE(map.complete());
  EXPECT_EQ(loader.under_way(), 3U);
  EXPECT_FALSE(map.sample(0.0, 0.0, &e));
  int cycles = 0;
  while (!map.complete() && ++cycles < 100) {
    loader.work();
    map.follow({0.0, 0.0}, &loader);
    if (!map.sample(0.0, 0.0, &e)) continue;
    EXPECT_NEAR(e.z_m, 0.0, 0.7);  // by a coarser level first
  }
  EXPECT_TRUE(map.complete());
  ASSERT_TRUE(map.sample(0.0, 0.0, &e));
  EXPECT_EQ(e.level, 0);
  // The vehicle moves faster than tiles are loaded: no tile that was left behind is used for the
  // ground ahead.
  for (double x = 0.0; x < 1200.0; x += 40.0) {
    map.follow({x, 0.0}, &loader);
    loader.work();
    for (const double dx : {-50.0, 0.0, 50.0}) {
      if (!map.sample(x + dx, 10.0, &e)) continue;
      EXPECT_NEAR(e.z_m, 8.0 * std::sin(0.01 * (x + dx)) * std::cos(0.13), 0.7);
    }
  }
}

TEST_F(MapOnDisk, ATruncatedOrReplacedFileIsReportedWithoutACrash) {
  const Result<MapFolder> folder = MapFolder::open(path_);
  ASSERT_TRUE(folder);
  ElevationMap map = opened(60.0);
  fs::resize_file(folder->file_of(0, {0, 0}), 5000);
  Raster other = cut(raster_, first_cell({-1, 0}), kTileSide, kTileSide);
  for (float& z : other.z_m) z += 100.0F;
  const std::string other_path = path_ + "_other";
  fs::remove_all(other_path);
  ASSERT_TRUE(mapping::write_map(other_path, test::frame(), other));
  fs::copy_file(MapFolder::open(other_path)->file_of(0, {-1, 0}), folder->file_of(0, {-1, 0}),
                fs::copy_options::overwrite_existing);
  fs::remove_all(other_path);

  DirectTileLoader loader(path_);
  map.follow({0.0, 0.0}, &loader);
  EXPECT_TRUE(map.complete());
  EXPECT_EQ(map.loading().failed, 2);
  EXPECT_NE(map.loading().failure.find("is not the file of the map's index"), std::string::npos)
      << map.loading().failure;
  Elevation e;
  ASSERT_TRUE(map.sample(30.0, 30.0, &e));  // the coarser level replaces it
  EXPECT_EQ(e.level, 1);
  ASSERT_TRUE(map.sample(-30.0, 30.0, &e));
  EXPECT_EQ(e.level, 1) << "a sound tile of another map is not used";
  EXPECT_LT(e.z_m, 90.0);
  map.follow({5.0, 0.0}, &loader);
  EXPECT_EQ(map.loading().failed, 2) << "not counted again for each attempt";
}

TEST_F(MapOnDisk, PointsAreLoadedAndTheirMemoryIsKnownBeforehand) {
  const std::size_t bare = opened(60.0).memory_bytes();
  raster_.points = test::random_points(8, raster_, 20000);
  fs::remove_all(path_);
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), raster_));
  ElevationMap map = opened(60.0);
  const std::size_t before = map.memory_bytes();
  EXPECT_GT(before, bare);
  DirectTileLoader loader(path_);
  StandingHere here;
  EXPECT_FALSE(map.closest_point({0.0, 0.0, 5.0}, 20.0, &here)) << "not loaded yet";
  for (double x = -100.0; x < 1300.0; x += 35.0) {
    map.follow({x, 3.0}, &loader);
    const Vec3 p(x, 3.0, 5.0);
    const double nearest_m = *closest_of(raster_, p);
    ASSERT_EQ(map.closest_point(p, 20.0, &here), nearest_m < 20.0) << x;
    if (nearest_m < 20.0) {
      EXPECT_NEAR((here.p_m - p).norm(), nearest_m, 1e-3);
    }
  }
  EXPECT_EQ(map.memory_bytes(), before);
  EXPECT_EQ(map.loading().failed, 0);

  // A file of another map, with more points than the index states.
  const Result<MapFolder> folder = MapFolder::open(path_);
  Raster other = cut(raster_, first_cell({0, 0}), kTileSide, kTileSide);
  other.points = test::random_points(9, other, kMaxSurfacePoints);
  const std::string other_path = path_ + "_other";
  fs::remove_all(other_path);
  ASSERT_TRUE(mapping::write_map(other_path, test::frame(), other));
  fs::copy_file(MapFolder::open(other_path)->file_of(0, {0, 0}), folder->file_of(0, {0, 0}),
                fs::copy_options::overwrite_existing);
  fs::remove_all(other_path);
  ElevationMap again = opened(60.0);
  again.follow({0.0, 0.0}, &loader);
  EXPECT_EQ(again.loading().failed, 1);
  EXPECT_NE(again.loading().failure.find("is not the file of the map's index"), std::string::npos)
      << again.loading().failure;
}

TEST_F(MapOnDisk, AMapThatExceedsTheMemoryIsRejectedBeforeTheDrive) {
  const Result<ElevationMap> map = ElevationMap::open(path_, {500.0, 2e6});
  ASSERT_FALSE(map);
  EXPECT_NE(map.error().message.find("2 allowed"), std::string::npos) << map.error().message;
  EXPECT_FALSE(ElevationMap::open(path_ + "/nowhere", {100.0, 64e6}));
}

}  // namespace
}  // namespace rcs

#include "rcs/prior/async_tile_loader.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "rcs/terrain/elevation_map.h"
#include "rcs/terrain/map_tile.h"
#include "tests/support/fresh_folder.h"
#include "tools/mapping/map_writer.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

Raster slope(int width) {
  Raster r;
  r.width = width;
  r.height = kTileSide;
  for (int k = 0; k < width * kTileSide; ++k) {
    r.z_m.push_back(0.01F * static_cast<float>(k % width));
  }
  return r;
}

class AsyncTileLoaderTest : public testing::Test {
 protected:
  AsyncTileLoaderTest() : path_((test::fresh_folder() / "map").string()) {
    MapFrame frame;
    frame.datum = {0.7, -1.3, {100.0}};
    EXPECT_TRUE(mapping::write_map(path_, frame, slope(40 * kTileSide)));
  }
  ~AsyncTileLoaderTest() override { fs::remove_all(fs::path(path_).parent_path()); }
  std::string path_;
};

TEST_F(AsyncTileLoaderTest, LoadsTheSameTilesAsSynchronousReading) {
  const MapWindow window{700.0, 256e6};
  Result<ElevationMap> now = ElevationMap::open(path_, window);
  Result<ElevationMap> later = ElevationMap::open(path_, window);
  ASSERT_TRUE(now && later);
  DirectTileLoader direct(path_);
  AsyncTileLoader async(path_);
  for (double x = 100.0; x < 10000.0; x += 900.0) {
    now->follow({x, 100.0}, &direct);
    do {
      later->follow({x, 100.0}, &async);
      std::this_thread::yield();
    } while (!later->complete());
    for (double dx = -600.0; dx < 700.0; dx += 87.0) {
      Elevation a, b;
      const bool known = now->sample(x + dx, 100.0, &a);
      ASSERT_EQ(later->sample(x + dx, 100.0, &b), known);
      EXPECT_EQ(a.z_m, b.z_m);
    }
  }
  EXPECT_EQ(later->loading().failed, 0);
}

TEST_F(AsyncTileLoaderTest, EndsCleanlyWithTilesBeingLoaded) {
  for (int k = 0; k < 20; ++k) {
    Result<ElevationMap> map = ElevationMap::open(path_, {2000.0, 256e6});
    ASSERT_TRUE(map);
    AsyncTileLoader loader(path_);
    map->follow({5000.0, 100.0}, &loader);
    EXPECT_FALSE(map->complete());
  }
}

TEST_F(AsyncTileLoaderTest, ADeletedMapIsReportedWithoutACrash) {
  Result<ElevationMap> map = ElevationMap::open(path_, {100.0, 256e6});
  ASSERT_TRUE(map);
  fs::remove_all(path_);
  AsyncTileLoader loader(path_);
  do {
    map->follow({5000.0, 100.0}, &loader);
    std::this_thread::yield();
  } while (!map->complete());
  EXPECT_GT(map->loading().failed, 0);
  EXPECT_NE(map->loading().failure.find("cannot open"), std::string::npos);
}

}  // namespace
}  // namespace rcs

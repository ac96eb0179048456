#include "rcs/terrain/map_folder.h"
#include "tools/mapping/map_writer.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "rcs/terrain/map_tile.h"
#include "tests/support/files_next_to.h"
#include "tests/terrain/map_scene.h"
#include "tools/mapping/coarser.h"

namespace rcs {
namespace {

namespace fs = std::filesystem;

class MapFolderTest : public testing::Test {
 protected:
  MapFolderTest()
      : path_(testing::TempDir() + "rcs_map_" +
              testing::UnitTest::GetInstance()->current_test_info()->name()) {
    clear();
  }
  ~MapFolderTest() override { clear(); }
  void clear() const {
    fs::remove_all(path_);
    for (const std::string& name : test::files_next_to(path_))
      fs::remove_all(testing::TempDir() + name);
  }
  MapFolder opened() {
    Result<MapFolder> folder = MapFolder::open(path_);
    EXPECT_TRUE(folder) << folder.error().message;
    return std::move(folder).value();
  }
  std::string path_;
  std::vector<std::uint8_t> buffer_;
};

TEST_F(MapFolderTest, AWrittenMapIsRead) {
  const Raster raster = test::random_raster(2, {-300, 10}, 700, 300);
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), raster));
  const MapFolder folder = opened();
  EXPECT_EQ(folder.index().frame.source_crs, "EPSG:32618");
  EXPECT_EQ(folder.index().frame.datum.lat_rad, test::frame().datum.lat_rad);
  const MapLevelIndex& level = folder.index().levels.front();
  EXPECT_EQ(level.tiles.size(), 8U);
  for (const MapTileEntry& e : level.tiles) {
    const Result<Raster> tile = folder.read(0, e.tile, &buffer_);
    ASSERT_TRUE(tile) << tile.error().message;
    EXPECT_TRUE(test::same(*tile, cut(raster, tile->first, kTileSide, kTileSide)));
  }
}

TEST_F(MapFolderTest, AFifoAsIndexOrTileIsRejectedWithoutWaiting) {
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), test::random_raster(2, {0, 0}, 20, 20)));
  const MapFolder folder = opened();
  const Cell number = folder.index().levels.front().tiles.front().tile;
  const std::string tile = folder.file_of(0, number);
  const std::string index = path_ + "/map.index";
  for (const std::string& file : {tile, index}) {
    fs::remove(file);
    ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
  }
  EXPECT_EQ(MapFolder::open(path_).error().message, index + ": is not a regular file");
  EXPECT_EQ(folder.read(0, number, &buffer_).error().message, tile + ": is not a regular file");
}

TEST_F(MapFolderTest, PointsGoWithTheirTiles) {
  Raster raster = test::random_raster(2, {-300, 10}, 700, 300);
  raster.points = test::random_points(5, raster, 3000);
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), raster));
  const MapFolder folder = opened();
  std::size_t points = 0;
  for (const MapTileEntry& e : folder.index().levels.front().tiles) {
    const Result<Raster> tile = folder.read(0, e.tile, &buffer_);
    ASSERT_TRUE(tile) << tile.error().message;
    EXPECT_TRUE(test::same(*tile, cut(raster, tile->first, kTileSide, kTileSide)));
    EXPECT_EQ(e.points, tile->points.size());
    points += e.points;
  }
  EXPECT_EQ(points, 3000U);
  std::vector<std::uint8_t> index = encode_index(folder.index());
  EXPECT_EQ(index[8], 2) << "version";
  MapIndex hostile = folder.index();
  hostile.levels.front().tiles.front().points = kMaxSurfacePoints + 1;
  EXPECT_FALSE(check_index(hostile));
}

TEST_F(MapFolderTest, ATileWithTooManyPointsIsThinned) {
  Raster raster = test::random_raster(2, {0, 0}, kTileSide, kTileSide);
  raster.points = test::random_points(6, raster, 3 * kMaxSurfacePoints);
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), raster));
  const Result<Raster> tile = opened().read(0, {0, 0}, &buffer_);
  ASSERT_TRUE(tile) << tile.error().message;
  EXPECT_LE(tile->points.size(), kMaxSurfacePoints);
  EXPECT_GT(tile->points.size(), kMaxSurfacePoints / 8);
}

TEST_F(MapFolderTest, CoarserLevelsAreTheSameGround) {
  const MapLevel level{1.0, Vec2::Zero(), 0.0, 1.0};
  const Raster raster = test::hills(level, {0, 0}, 5 * kTileSide, kTileSide);
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), raster));
  const MapFolder folder = opened();
  ASSERT_EQ(folder.index().levels.size(), 3U);
  EXPECT_EQ(folder.index().levels[1].level.cell_m, 4.0);
  EXPECT_EQ(folder.index().levels[2].level.cell_m, 16.0);
  for (int k = 1; k <= 2; ++k) {
    const MapLevelIndex& coarse = folder.index().levels[static_cast<std::size_t>(k)];
    const Result<Raster> tile = folder.read(k, coarse.tiles.front().tile, &buffer_);
    ASSERT_TRUE(tile) << tile.error().message;
    for (std::size_t at = 0; at < kTileCells; at += 37) {
      if (std::isnan(tile->z_m[at])) continue;
      const Vec2 p = coarse.level.centre({tile->first.i + static_cast<int>(at) % kTileSide,
                                          tile->first.j + static_cast<int>(at) / kTileSide});
      const double z = 8.0 * std::sin(0.01 * p.x()) * std::cos(0.013 * p.y());
      // The mean over a cell of a surface that bends.
      const double bend = 8.0 * 0.013 * 0.013 * coarse.level.cell_m * coarse.level.cell_m;
      EXPECT_NEAR(tile->z_m[at], z, 0.1 * bend + 1e-4);
      const double sigma = layer_at(tile->sigma_m, at);
      EXPECT_GT(sigma, 0.1 / 9.0);  // a third of 0.1 is shared, from level to level
      EXPECT_LT(sigma, 0.16 + bend);
    }
  }
}

TEST_F(MapFolderTest, LaterCellsReplaceEarlierOnesUnlessUnknown) {
  Raster first = test::random_raster(3, {0, 0}, 100, 100);
  Raster second = test::random_raster(4, {50, 50}, 100, 100);
  second.source = {CellSource::kSensed};
  second.z_m[0] = std::numeric_limits<float>::quiet_NaN();
  Result<mapping::MapWriter> writer =
      mapping::MapWriter::create(path_, test::frame(), {first.level});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->put(0, first));
  ASSERT_TRUE(writer->put(0, second));
  ASSERT_TRUE(writer->finish());
  const Result<Raster> tile = opened().read(0, {0, 0}, &buffer_);
  ASSERT_TRUE(tile);
  EXPECT_EQ(tile->z_m[tile->at({49, 49})], first.z_m[first.at({49, 49})]);
  EXPECT_EQ(tile->z_m[tile->at({50, 50})], first.z_m[first.at({50, 50})]);
  EXPECT_EQ(tile->z_m[tile->at({51, 50})], second.z_m[second.at({51, 50})]);
  EXPECT_EQ(layer_at(tile->source, tile->at({50, 50})), CellSource::kAerial);
  EXPECT_EQ(layer_at(tile->source, tile->at({51, 50})), CellSource::kSensed);
}

TEST_F(MapFolderTest, AMapAppearsWhenItIsComplete) {
  const Raster raster = test::random_raster(5, {0, 0}, 10, 10);
  {
    Result<mapping::MapWriter> writer =
        mapping::MapWriter::create(path_, test::frame(), {raster.level});
    ASSERT_TRUE(writer);
    ASSERT_TRUE(writer->put(0, raster));
    EXPECT_EQ(test::files_next_to(path_).size(), 1U);
    EXPECT_FALSE(fs::exists(path_));
  }
  EXPECT_TRUE(test::files_next_to(path_).empty());
  EXPECT_FALSE(MapFolder::open(path_));
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), raster));
  EXPECT_TRUE(test::files_next_to(path_).empty());
  const Raster wider = test::random_raster(5, {0, 0}, 300, 10);
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), wider));  // replaced as a whole
  EXPECT_EQ(opened().index().levels.front().tiles.size(), 2U);
  EXPECT_TRUE(test::files_next_to(path_).empty());
  fs::remove(path_ + "/map.index");
  const Outcome over = mapping::write_map(path_, test::frame(), raster);
  ASSERT_FALSE(over);
  EXPECT_NE(over.error().message.find("not a map"), std::string::npos);
}

TEST_F(MapFolderTest, NeighbouringFoldersAreNotTouched) {
  const Raster raster = test::random_raster(5, {0, 0}, 10, 10);
  const std::string own = path_ + "." + std::to_string(::getpid()) + ".0";
  std::vector<std::string> files;
  for (const std::string& folder : {path_ + ".old", path_ + ".part", own + ".old", own + ".part"}) {
    fs::create_directory(folder);
    files.push_back(folder + "/precious");
    std::ofstream(files.back()) << "precious";
  }
  for (int k = 0; k < 2; ++k) ASSERT_TRUE(mapping::write_map(path_, test::frame(), raster));
  for (const std::string& file : files) EXPECT_TRUE(fs::exists(file)) << file;
  EXPECT_EQ(test::files_next_to(path_).size(), files.size());
}

TEST_F(MapFolderTest, AMapWithOtherFilesInItIsNotReplaced) {
  const Raster raster = test::random_raster(5, {0, 0}, 10, 10);
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), raster));
  const std::string level = fs::path(opened().file_of(0, {0, 0})).parent_path().string();
  for (const std::string& other : {path_ + "/run.log", level + "/notes.txt", path_ + "/0_0.tile",
                                   level + "/1_2.tile.bak", path_ + "/logs"}) {
    if (other.back() == 's') {
      fs::create_directory(other);
    } else {
      std::ofstream(other) << "precious";
    }
    const Outcome over = mapping::write_map(path_, test::frame(), raster);
    ASSERT_FALSE(over) << other;
    EXPECT_NE(over.error().message.find(other), std::string::npos) << over.error().message;
    EXPECT_NE(over.error().message.find("move it elsewhere"), std::string::npos);
    EXPECT_TRUE(fs::exists(other));
    fs::remove(other);
  }
  // Or appears while the map is written.
  Result<mapping::MapWriter> writer =
      mapping::MapWriter::create(path_, test::frame(), {raster.level});
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->put(0, raster));
  std::ofstream(path_ + "/run.log") << "precious";
  EXPECT_FALSE(writer->finish());
  EXPECT_TRUE(fs::exists(path_ + "/run.log"));
  fs::remove(path_ + "/run.log");
  EXPECT_TRUE(writer->finish());
  EXPECT_TRUE(MapFolder::open(path_));
  EXPECT_TRUE(test::files_next_to(path_).empty());
}

TEST_F(MapFolderTest, ALinkToAMapStaysALink) {
  const Raster raster = test::random_raster(5, {0, 0}, 10, 10);
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), raster));
  const std::string link = path_ + ".link";
  fs::create_directory_symlink(path_, link);
  ASSERT_TRUE(mapping::write_map(link, test::frame(), test::random_raster(5, {0, 0}, 300, 10)));
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(opened().index().levels.front().tiles.size(), 2U);
}

TEST_F(MapFolderTest, DamageOnDiskIsNamed) {
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), test::random_raster(6, {0, 0}, 300, 10)));
  const MapFolder folder = opened();
  const std::string file = folder.file_of(0, {1, 0});
  fs::resize_file(file, 1000);
  const Result<Raster> tile = folder.read(0, {1, 0}, &buffer_);
  ASSERT_FALSE(tile);
  EXPECT_NE(tile.error().message.find(file), std::string::npos);
  EXPECT_NE(tile.error().message.find("truncated"), std::string::npos);
  fs::copy_file(folder.file_of(0, {0, 0}), file, fs::copy_options::overwrite_existing);
  EXPECT_NE(folder.read(0, {1, 0}, &buffer_).error().message.find("contains tile 0, 0"),
            std::string::npos);
  fs::resize_file(path_ + "/map.index", 60);
  const Result<MapFolder> cut_short = MapFolder::open(path_);
  ASSERT_FALSE(cut_short);
  EXPECT_NE(cut_short.error().message.find("map.index"), std::string::npos);
}

// A sound tile that somebody put in place of another one.
TEST_F(MapFolderTest, ATileThatIsNotThatOfTheIndexIsRejected) {
  const std::string other = path_ + "_other";
  ASSERT_TRUE(mapping::write_map(path_, test::frame(), test::random_raster(2, {0, 0}, 20, 20)));
  ASSERT_TRUE(mapping::write_map(other, test::frame(), test::random_raster(3, {0, 0}, 20, 20)));
  const MapFolder folder = opened();
  const Cell tile = folder.index().levels.front().tiles.front().tile;
  ASSERT_TRUE(folder.read(0, tile, &buffer_));
  fs::copy_file(MapFolder::open(other)->file_of(0, tile), folder.file_of(0, tile),
                fs::copy_options::overwrite_existing);
  const Result<Raster> changed = folder.read(0, tile, &buffer_);
  ASSERT_FALSE(changed);
  EXPECT_NE(changed.error().message.find("not the file of the map's index"), std::string::npos);
}

TEST(MapIndex, ChangedBytesAndForgedCountsAreRejected) {
  MapIndex index;
  index.frame = test::frame();
  index.levels.push_back({MapLevel{}, {{{-1, 2}, 7, 8, 1.0F, 2.0F}, {{3, 2}, 7, 8, 1.0F, 2.0F}}});
  const std::vector<std::uint8_t> bytes = encode_index(index);
  const Result<MapIndex> back = decode_index(bytes);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(encode_index(*back), bytes);
  ASSERT_NE(back->levels.front().find({3, 2}), nullptr);
  EXPECT_EQ(back->levels.front().find({2, 2}), nullptr);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::vector<std::uint8_t> bad = bytes;
    bad[i] = static_cast<std::uint8_t>(bad[i] ^ 0x41U);
    EXPECT_FALSE(decode_index(bad)) << i;
    EXPECT_FALSE(decode_index({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(i)}));
  }
}

TEST(MapIndex, TileNumbersBeyondIntAreRejected) {
  for (const Cell far : {Cell{0, std::numeric_limits<int>::max()},
                         Cell{std::numeric_limits<int>::min(), 0}, Cell{1 << 22, 0}}) {
    MapIndex index;
    index.frame = test::frame();
    index.levels.push_back({MapLevel{}, {{far, 7, 8, 1.0F, 2.0F}}});
    const Outcome checked = check_index(index);
    ASSERT_FALSE(checked);
    EXPECT_NE(checked.error().message.find("2^22"), std::string::npos);
  }
}

TEST(MapIndex, AnotherDatumOrHeightKindIsRejectedWithBothNamed) {
  MapFrame map = test::frame();
  EXPECT_TRUE(check_frame(map, "WGS84"));
  const std::string frames = check_frame(map, "NAD83(2011)").error().message;
  EXPECT_NE(frames.find("WGS84"), std::string::npos);
  EXPECT_NE(frames.find("NAD83(2011)"), std::string::npos);
  map.heights = "EGM96";
  const std::string heights = check_frame(map, "WGS84").error().message;
  EXPECT_NE(heights.find("EGM96"), std::string::npos);
  EXPECT_NE(heights.find("ellipsoid"), std::string::npos);
}

TEST(MapIndex, TheLatticeIdDependsOnDatumAndCellSizeOnly) {
  const MapFrame f = test::frame();
  const MapLevel level;
  MapFrame higher = f;
  higher.datum.height.m += 34.0;
  MapLevel finer = level;
  finer.cell_m *= 0.5;
  EXPECT_NE(lattice_id(f, level), lattice_id(higher, level));
  EXPECT_NE(lattice_id(f, level), lattice_id(f, finer));
  MapFrame renamed = f;
  renamed.source_crs = "EPSG:4326";
  EXPECT_EQ(lattice_id(f, level), lattice_id(renamed, level));
}

TEST(Coarser, AMeanOfAPlaneIsThePlaneAndHolesAreUnknown) {
  Raster fine;
  fine.level.cell_m = 1.0;
  fine.width = fine.height = 8;
  for (int j = 0; j < 8; ++j) {
    for (int i = 0; i < 8; ++i) fine.z_m.push_back(static_cast<float>(100 + 2 * i - j));
  }
  fine.sigma_m = {0.5F};
  fine.count = {2};
  fine.source.assign(64, CellSource::kAerial);
  fine.source[0] = CellSource::kSensed;
  for (const std::size_t k : {4U, 5U, 12U}) fine.z_m[k] = std::numeric_limits<float>::quiet_NaN();
  for (int j = 4; j < 8; ++j) {
    for (int i = 4; i < 7; ++i) {
      fine.z_m[static_cast<std::size_t>(8 * j + i)] = std::numeric_limits<float>::quiet_NaN();
    }
  }
  Raster coarse;
  coarse.level.cell_m = 4.0;
  coarse.width = coarse.height = 2;
  coarse.z_m.assign(4, std::numeric_limits<float>::quiet_NaN());
  mapping::paste_coarser(fine, &coarse);
  EXPECT_NEAR(coarse.z_m[0], 100 + 2 * 1.5 - 1.5, 1e-4);
  EXPECT_NEAR(coarse.z_m[1], 100 + 2 * 5.5 - 1.5, 1e-4);  // three cells less do not tilt it
  EXPECT_NEAR(coarse.sigma_m[0], 0.5 / 3.0, 1e-3);        // error that neighbours share
  EXPECT_TRUE(std::isnan(coarse.z_m[3]));
  EXPECT_EQ(coarse.count[0], 32);
  EXPECT_EQ(coarse.count[1], 26);
  EXPECT_EQ(coarse.source[0], CellSource::kMixed);
  EXPECT_EQ(coarse.source[1], CellSource::kAerial);
}

}  // namespace
}  // namespace rcs

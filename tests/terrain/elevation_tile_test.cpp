#include "rcs/terrain/elevation_tile.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

namespace rcs {
namespace {

ElevationTile example() {
  ElevationTile t;
  t.id = 7;
  t.datum = {radians(40.43), radians(-76.57), {150.0}};
  t.undulation_m = -33.5;
  t.origin_world_m = {-20.0, 35.0};
  t.cell_m = 5.0;
  t.width = 4;
  t.height = 3;
  for (int i = 0; i < 12; ++i) t.z_world_m.push_back(0.25F * static_cast<float>(i * i));
  t.z_world_m[5] = std::numeric_limits<float>::quiet_NaN();
  t.sigma_m = 0.3;
  t.cell_sigma_m.assign(12, 0.4F);
  t.bias_sigma_m = 0.5;
  t.bias_correlation_m = 500.0;
  return t;
}

bool rejected_with(const std::vector<std::uint8_t>& bytes, const std::string& why) {
  const Result<std::vector<ElevationTile>> r = decode_tiles(bytes, "x.tile");
  return !r && r.error().message.find("x.tile") != std::string::npos &&
         r.error().message.find(why) != std::string::npos;
}

TEST(ElevationTile, RoundTripIsByteExact) {
  const std::vector<std::uint8_t> bytes = encode_tile(example());
  const Result<std::vector<ElevationTile>> tiles = decode_tiles(bytes, "x.tile");
  ASSERT_TRUE(tiles) << tiles.error().message;
  ASSERT_EQ(tiles->size(), 1U);
  EXPECT_EQ(encode_tile(tiles->front()), bytes);
  EXPECT_EQ(tiles->front().id, 7);
  EXPECT_EQ(tiles->front().datum.lon_rad, example().datum.lon_rad);
  EXPECT_TRUE(std::isnan(tiles->front().z_world_m[5]));
}

TEST(ElevationTile, LayoutIsTheDocumentedOne) {
  const std::vector<std::uint8_t> bytes = encode_tile(example());
  EXPECT_EQ(bytes.size(), 116U + 2 * 12 * 4);
  EXPECT_EQ(std::string(bytes.begin(), bytes.begin() + 8), "RCSELEV\n");
  EXPECT_EQ(bytes[8], 1);       // version, low byte first
  EXPECT_EQ(bytes[16], 7);      // id
  EXPECT_EQ(bytes[104], 4);     // width
  EXPECT_EQ(bytes[112], 1);     // sigma by cell
  EXPECT_EQ(bytes[123], 0x3E);  // z(1) = 0.25F = 0x3E800000
}

TEST(ElevationTile, FilesHoldSeveralTiles) {
  const std::string path = testing::TempDir() + "several.tile";
  ElevationTile second = example();
  second.id = 8;
  ASSERT_TRUE(write_tiles({example(), second}, path));
  const Result<std::vector<ElevationTile>> tiles = read_tiles(path);
  ASSERT_TRUE(tiles) << tiles.error().message;
  ASSERT_EQ(tiles->size(), 2U);
  EXPECT_EQ((*tiles)[1].id, 8);
  std::remove(path.c_str());
  EXPECT_FALSE(read_tiles(path));
  EXPECT_FALSE(write_tile(example(), "/nonexistent/a.tile"));
}

TEST(ElevationTile, EveryTruncationIsRefused) {
  const std::vector<std::uint8_t> bytes = encode_tile(example());
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    EXPECT_TRUE(
        rejected_with({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n)}, "truncated"))
        << n;
  }
}

TEST(ElevationTile, EveryFlippedByteIsRefused) {
  const std::vector<std::uint8_t> bytes = encode_tile(example());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::vector<std::uint8_t> bad = bytes;
    bad[i] = static_cast<std::uint8_t>(bad[i] ^ 0x41U);
    EXPECT_FALSE(decode_tiles(bad, "x.tile")) << i;
  }
}

TEST(ElevationTile, HostileHeadersAreNamed) {
  const std::vector<std::uint8_t> bytes = encode_tile(example());
  std::vector<std::uint8_t> magic = bytes;
  magic[0] = 'X';
  EXPECT_TRUE(rejected_with(magic, "magic"));
  std::vector<std::uint8_t> version = bytes;
  version[8] = 9;
  EXPECT_TRUE(rejected_with(version, "version 9"));
  std::vector<std::uint8_t> huge = bytes;
  for (std::size_t i = 104; i < 112; ++i) huge[i] = 0xFF;
  EXPECT_TRUE(rejected_with(huge, "size 4294967295"));
  std::vector<std::uint8_t> trailing = bytes;
  trailing.push_back(0);
  EXPECT_TRUE(rejected_with(trailing, "tile 2"));
}

TEST(ElevationTile, NonsenseIsNotWritten) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ElevationTile t = example();
  t.cell_m = nan;
  EXPECT_FALSE(check_tile(t));
  t = example();
  t.sigma_m = 0.0;
  EXPECT_FALSE(check_tile(t));
  t = example();
  t.datum.lat_rad = nan;
  EXPECT_FALSE(check_tile(t));
  t = example();
  t.z_world_m.pop_back();
  EXPECT_FALSE(check_tile(t));
  t = example();
  t.z_world_m[0] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(check_tile(t));
  EXPECT_FALSE(write_tile(t, testing::TempDir() + "never.tile"));
}

}  // namespace
}  // namespace rcs

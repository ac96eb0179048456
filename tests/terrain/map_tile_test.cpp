#include "rcs/terrain/map_tile.h"

#include <gtest/gtest.h>

#include <string>

#include "rcs/base/byte_codec.h"
#include "tests/terrain/map_scene.h"

namespace rcs {
namespace {

constexpr std::uint64_t kLattice = 0x1234567890ABCDEF;

Raster example() {
  Raster t = test::random_raster(1, first_cell({-3, 12}), kTileSide, kTileSide);
  t.z_m[5] = std::numeric_limits<float>::quiet_NaN();
  return t;
}

Raster layered() {
  Raster t = example();
  t.sigma_m.assign(kTileCells, 0.4F);
  t.sigma_m[7] = 0.2F;
  t.count.assign(kTileCells, 3);
  t.date.assign(kTileCells, 9000);
  t.source.assign(kTileCells, CellSource::kSensed);
  return t;
}

Raster with_points() {
  Raster t = layered();
  t.points = test::random_points(3, t, 100);
  return t;
}

std::string why_not(const std::vector<std::uint8_t>& bytes) {
  const Result<Raster> r = decode_tile(bytes.data(), bytes.size(), kLattice);
  return r ? "" : r.error().message;
}

/// Bytes with a header field changed and a checksum that fits.
template <class T>
std::vector<std::uint8_t> forged(std::size_t at, T value) {
  std::vector<std::uint8_t> bytes = encode_tile(example(), kLattice);
  wire::put(value, bytes.data() + at);
  wire::put(crc32(bytes.data() + 16, bytes.size() - 16), bytes.data() + 12);
  return bytes;
}

TEST(Wire, ChecksumIsCrc32OfIeee) {
  const std::string text = "123456789 and 123456789";
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  EXPECT_EQ(crc32(bytes, 9), 0xCBF43926U);  // the check value that the standard gives
  std::uint32_t c = 0xFFFFFFFFU;            // bit by bit, to check the computation by eight bytes
  for (const char byte : text) {
    c ^= static_cast<std::uint8_t>(byte);
    for (int k = 0; k < 8; ++k) c = (c & 1U) != 0 ? 0xEDB88320U ^ (c >> 1U) : c >> 1U;
  }
  EXPECT_EQ(crc32(bytes, text.size()), ~c);
}

TEST(MapTile, RoundTripIsByteExact) {
  for (const Raster& t : {example(), layered(), with_points()}) {
    const std::vector<std::uint8_t> bytes = encode_tile(t, kLattice);
    const Result<Raster> back = decode_tile(bytes.data(), bytes.size(), kLattice);
    ASSERT_TRUE(back) << back.error().message;
    EXPECT_TRUE(test::same(*back, t));
    EXPECT_EQ(encode_tile(*back, kLattice), bytes);
  }
}

TEST(MapTile, LayoutIsTheDocumentedOne) {
  const std::vector<std::uint8_t> bytes = encode_tile(example(), kLattice);
  EXPECT_EQ(bytes.size(), 88U + kTileCells * 4);
  Raster most = layered();
  EXPECT_EQ(encode_tile(most, kLattice).size(), 88U + kTileCells * 13);
  most.points = test::random_points(4, most, kMaxSurfacePoints);
  EXPECT_EQ(encode_tile(most, kLattice).size(), kMaxTileBytes);
  EXPECT_EQ(std::string(bytes.begin(), bytes.begin() + 8), "RCSTILE\n");
  EXPECT_EQ(bytes[8], 1);      // version, low byte first
  EXPECT_EQ(bytes[16], 0xEF);  // lattice
  EXPECT_EQ(bytes[24], 0xFD);  // i = -3
  EXPECT_EQ(bytes[28], 12);    // j
  EXPECT_EQ(bytes[84], 2);     // aerial
}

TEST(MapTile, TruncatedAndChangedBytesAreRejected) {
  const std::vector<std::uint8_t> bytes = encode_tile(example(), kLattice);
  for (const std::size_t n : {std::size_t{0}, std::size_t{7}, std::size_t{87}, std::size_t{88},
                              bytes.size() / 2, bytes.size() - 1}) {
    EXPECT_NE(
        why_not({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n)}).find("truncated"),
        std::string::npos)
        << n;
  }
  std::vector<std::uint8_t> longer = bytes;
  longer.push_back(0);
  EXPECT_NE(why_not(longer).find("too long"), std::string::npos);
  for (std::size_t i = 0; i < bytes.size(); i = i < 100 ? i + 1 : i + 9973) {
    std::vector<std::uint8_t> bad = bytes;
    bad[i] = static_cast<std::uint8_t>(bad[i] ^ 0x41U);
    EXPECT_NE(why_not(bad), "") << i;
  }
}

// A tile without points equals one of version 1 to the byte: existing maps stay readable.
TEST(MapTile, PointsAreASectionOfVersion2) {
  const std::vector<std::uint8_t> old = encode_tile(layered(), kLattice);
  const Raster t = with_points();
  const std::vector<std::uint8_t> bytes = encode_tile(t, kLattice);
  EXPECT_EQ(old[8], 1);
  EXPECT_EQ(bytes[8], 2);
  ASSERT_EQ(bytes.size(), old.size() + 4 + 28 * t.points.size());
  EXPECT_TRUE(std::equal(old.begin() + 16, old.end(), bytes.begin() + 16));
  EXPECT_EQ(wire::take<std::uint32_t>(bytes.data() + old.size()), 100U);
  EXPECT_EQ(wire::take<float>(bytes.data() + old.size() + 4), t.points[0].p_m.x());
  EXPECT_EQ(wire::take<float>(bytes.data() + old.size() + 4 + 24), t.points[0].sigma_m);
  const Result<Raster> back = decode_tile(old.data(), old.size(), kLattice);
  ASSERT_TRUE(back);
  EXPECT_TRUE(back->points.empty());
}

TEST(MapTile, ATruncatedOrHostileSectionOfPointsIsNamed) {
  const std::vector<std::uint8_t> sound = encode_tile(with_points(), kLattice);
  const std::size_t section = 88 + kTileCells * 13;
  for (const std::size_t n : {section, section + 3, section + 4, section + 31, sound.size() - 1}) {
    EXPECT_NE(
        why_not({sound.begin(), sound.begin() + static_cast<std::ptrdiff_t>(n)}).find("truncated"),
        std::string::npos)
        << n;
  }
  for (std::size_t i = section; i < sound.size(); i += 97) {
    std::vector<std::uint8_t> bad = sound;
    bad[i] = static_cast<std::uint8_t>(bad[i] ^ 0x41U);
    EXPECT_NE(why_not(bad), "") << i;
  }
  const auto forged = [&](std::size_t at, auto value) {
    std::vector<std::uint8_t> bytes = sound;
    wire::put(value, bytes.data() + at);
    wire::put(crc32(bytes.data() + 16, bytes.size() - 16), bytes.data() + 12);
    return why_not(bytes);
  };
  const auto says = [](const std::string& why, const char* what) {
    return why.find(what) != std::string::npos;
  };
  EXPECT_TRUE(says(forged(section, std::uint32_t{0}), "has 0 surface points"));
  EXPECT_TRUE(says(forged(section, std::uint32_t{0xFFFFFFFF}), "1 to 8192 are allowed"));
  EXPECT_TRUE(says(forged(section, std::uint32_t{101}), "truncated"));
  EXPECT_TRUE(says(forged(section, std::uint32_t{99}), "too long"));
  EXPECT_TRUE(says(forged(8, std::uint32_t{1}), "too long"));
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  EXPECT_TRUE(says(forged(section + 4, -1.0F), "outside its tile"));
  EXPECT_TRUE(says(forged(section + 4, kNaN), "outside its tile"));
  EXPECT_TRUE(says(forged(section + 12, kNaN), "height"));
  EXPECT_TRUE(says(forged(section + 16, 7.0F), "normal"));
  EXPECT_TRUE(says(forged(section + 16, kNaN), "normal"));
  EXPECT_TRUE(says(forged(section + 28, 0.0F), "sigma"));
}

TEST(MapTile, HostileHeadersAreNamed) {
  EXPECT_NE(why_not(forged(0, std::uint8_t{'X'})).find("magic"), std::string::npos);
  EXPECT_NE(why_not(forged(8, std::uint32_t{9})).find("version 9"), std::string::npos);
  EXPECT_NE(why_not(forged(16, std::uint64_t{1})).find("another map"), std::string::npos);
  EXPECT_NE(why_not(forged(24, std::int32_t{2000000000})).find("number"), std::string::npos);
  EXPECT_NE(why_not(forged(32, -1.0)).find("cell"), std::string::npos);
  EXPECT_NE(why_not(forged(72, std::uint32_t{1})).find("truncated"), std::string::npos);
  EXPECT_NE(why_not(forged(72, std::uint32_t{16})).find("flags"), std::string::npos);
  EXPECT_NE(why_not(forged(76, -1.0F)).find("sigma"), std::string::npos);
  EXPECT_NE(why_not(forged(84, std::uint8_t{99})).find("source"), std::string::npos);
  EXPECT_NE(why_not(forged(88, 1e6F)).find("20 km"), std::string::npos);
}

}  // namespace
}  // namespace rcs

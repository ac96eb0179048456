#include "tools/survey/npy_raster.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

namespace rcs::survey {
namespace {

using testing::HasSubstr;

std::vector<std::uint8_t> npy(const std::string& type, const std::string& shape,
                              const std::vector<std::uint8_t>& data) {
  std::string header =
      "{'descr': '" + type + "', 'fortran_order': False, 'shape': " + shape + ", }";
  while ((10 + header.size() + 1) % 64 != 0) header += ' ';
  header += '\n';
  std::vector<std::uint8_t> bytes = {0x93, 'N', 'U', 'M', 'P', 'Y', 1, 0};
  bytes.push_back(static_cast<std::uint8_t>(header.size() & 0xFF));
  bytes.push_back(static_cast<std::uint8_t>(header.size() >> 8));
  bytes.insert(bytes.end(), header.begin(), header.end());
  bytes.insert(bytes.end(), data.begin(), data.end());
  return bytes;
}

TEST(Npy, HalfPrecisionIsIeee754) {
  // 1, -2, the largest, the smallest normal, the smallest of all, infinity, NaN, 0.333251953125.
  const std::vector<std::uint16_t> halves = {0x3C00, 0xC000, 0x7BFF, 0x0400,
                                             0x0001, 0x7C00, 0x7E00, 0x3555};
  std::vector<std::uint8_t> data;
  for (const std::uint16_t h : halves) {
    data.push_back(static_cast<std::uint8_t>(h & 0xFF));
    data.push_back(static_cast<std::uint8_t>(h >> 8));
  }
  const Result<NpyArray> a = parse_npy(npy("<f2", "(2, 4)", data), "a.npy");
  ASSERT_TRUE(a) << a.error().message;
  EXPECT_EQ(a->rows, 2);
  EXPECT_EQ(a->cols, 4);
  EXPECT_TRUE(a->half);
  EXPECT_EQ(a->values[0], 1.0F);
  EXPECT_EQ(a->values[1], -2.0F);
  EXPECT_EQ(a->values[2], 65504.0F);
  EXPECT_EQ(a->values[3], std::ldexp(1.0F, -14));
  EXPECT_EQ(a->values[4], std::ldexp(1.0F, -24));
  EXPECT_TRUE(std::isinf(a->values[5]));
  EXPECT_TRUE(std::isnan(a->values[6]));
  EXPECT_EQ(a->values[7], 0.333251953125F);
}

TEST(Npy, AFileThatContradictsItsHeaderIsRejected) {
  const std::vector<std::uint8_t> four(16, 0);
  const auto why = [](const std::vector<std::uint8_t>& bytes) {
    const Result<NpyArray> a = parse_npy(bytes, "a.npy");
    return a ? std::string() : a.error().message;
  };
  EXPECT_EQ(why(npy("<f4", "(2, 2)", four)), "");
  EXPECT_THAT(why(npy("<f8", "(2, 2)", four)), HasSubstr("found 16 bytes"));
  EXPECT_THAT(why(npy("<i4", "(2, 2)", four)), HasSubstr("float16"));
  EXPECT_THAT(why(npy("<f4", "(4,)", four)), HasSubstr("two dimensions"));
  EXPECT_THAT(why(npy("<f4", "(999999999, 999999999)", four)), HasSubstr("2^28"));
  EXPECT_THAT(why(npy("<f4", "(0, 4)", {})), HasSubstr("2^28"));
  std::vector<std::uint8_t> longer = npy("<f4", "(2, 2)", four);
  longer[8] = 0xFF;
  longer[9] = 0xFF;
  EXPECT_THAT(why(longer), HasSubstr("truncated"));
  const std::vector<std::uint8_t> whole = npy("<f4", "(2, 2)", four);
  for (std::size_t n = 0; n < whole.size(); ++n) {
    EXPECT_NE(why({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(n)}), "") << n;
  }
}

TEST(Npy, AHeaderOfAnyLengthIsReadOnASmallStack) {
  for (const char* begin : {"'descr':", "{'descr': '<f4', 'fortran_order': False, 'shape':",
                            "{'descr': '<f4', 'fortran_order': False, 'shape': ("}) {
    const std::string header = begin + std::string(4'000'000, ' ');
    std::vector<std::uint8_t> bytes = {0x93, 'N', 'U', 'M', 'P', 'Y', 2, 0};
    for (unsigned k = 0; k < 4; ++k) {
      bytes.push_back(static_cast<std::uint8_t>(header.size() >> (8 * k)));
    }
    bytes.insert(bytes.end(), header.begin(), header.end());
    EXPECT_FALSE(parse_npy(bytes, "a.npy")) << begin;
  }
}

TEST(Npy, ShapesWrittenByNumpyAreRead) {
  const std::vector<std::uint8_t> six(24, 0);
  for (const char* shape : {"(2, 3)", "(2,3)", "( 2 , 3 , )", "(2, 3,)"}) {
    const Result<NpyArray> a = parse_npy(npy("<f4", shape, six), "a.npy");
    ASSERT_TRUE(a) << shape << ": " << a.error().message;
    EXPECT_EQ(a->rows, 2);
    EXPECT_EQ(a->cols, 3);
  }
  for (const char* shape : {"(2, 3", "2, 3", "(2 3)", "(-2, -3)", "(2, 3, 1)", "(6,)", "()",
                            "(99999999999, 3)", "(2.0, 3)"}) {
    EXPECT_FALSE(parse_npy(npy("<f4", shape, six), "a.npy")) << shape;
  }
}

class Av2Test : public testing::Test {
 protected:
  Av2Test() {
    folder_ = (std::filesystem::temp_directory_path() / "rcs_av2_XXXXXX").string();
    EXPECT_NE(mkdtemp(folder_.data()), nullptr);
    // A slope of 5 cm a cell to the east, from 40 m on, in float16: 3.1 cm apart.
    std::vector<std::uint8_t> data;
    for (int j = 0; j < 20; ++j) {
      for (int i = 0; i < 30; ++i) {
        const double z = 40.0 + 0.05 * i;
        const auto half =
            static_cast<std::uint16_t>(0x5000 + static_cast<int>(std::lround((z - 32.0) * 32.0)));
        data.push_back(static_cast<std::uint8_t>(half & 0xFF));
        data.push_back(static_cast<std::uint8_t>(half >> 8));
      }
    }
    data[0] = 0x00;  // NaN in the first cell
    data[1] = 0x7E;
    write("x_ground_height_surface____PIT.npy", npy("<f2", "(20, 30)", data));
    const std::string sim2 = R"({"R": [1.0, 0.0, 0.0, 1.0], "t": [-5000.0, -2000.0], "s": 2.5})";
    write("x___img_Sim2_city.json", {sim2.begin(), sim2.end()});
  }
  ~Av2Test() override { std::filesystem::remove_all(folder_); }
  void write(const std::string& name, const std::vector<std::uint8_t>& bytes) const {
    std::ofstream(folder_ + "/" + name, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
  }
  std::string folder_;
};

TEST_F(Av2Test, LiesAtThePositionOfItsSimilarityAndIsNotTerraced) {
  const Result<ImportedRaster> map = import_av2(folder_, {});
  ASSERT_TRUE(map) << map.error().message;
  EXPECT_EQ(map->frame.reference, "AV2-PIT");
  EXPECT_EQ(map->raster.level.cell_m, 0.4);
  EXPECT_EQ(map->raster.level.centre({0, 0}), Vec2(5000.2, 2000.2));
  EXPECT_TRUE(std::isnan(map->raster.z_m[0]));
  double worst = 0.0;
  for (int i = 3; i < 27; ++i) {
    const std::size_t k = map->raster.at({i, 10});
    worst = std::max(worst, std::abs(map->raster.z_m[k] - (40.0 + 0.05 * i)));
  }
  EXPECT_LT(worst, 0.010);  // rounding alone: 0.0156
}

TEST_F(Av2Test, MissingAndInvalidFilesAreNamed) {
  write("x___img_Sim2_city.json", {'{', '}'});
  EXPECT_THAT(import_av2(folder_, {}).error().message, HasSubstr("expected numbers s, t and R"));
  std::filesystem::remove(folder_ + "/x___img_Sim2_city.json");
  EXPECT_THAT(import_av2(folder_, {}).error().message, HasSubstr("img_Sim2_city.json"));
}

}  // namespace
}  // namespace rcs::survey

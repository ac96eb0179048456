#include "tools/clouds/survey_points.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <utility>

#include "tests/tools/survey/las_file.h"
#include "tools/clouds/las_header.h"

namespace rcs::clouds {
namespace {

using test::LasFile;
using testing::HasSubstr;
using testing::StartsWith;

class SurveyPointsTest : public testing::Test {
 protected:
  SurveyPointsTest() {
    folder_ = (std::filesystem::temp_directory_path() / "rcs_points_XXXXXX").string();
    EXPECT_NE(mkdtemp(folder_.data()), nullptr);
  }
  ~SurveyPointsTest() override { std::filesystem::remove_all(folder_); }

  std::string put(const std::string& name, const std::string& bytes) const {
    std::string path = folder_ + "/" + name;
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  /// All points of a file, or the error, without the folder's name.
  [[nodiscard]] Result<SurveyPoints> read(const std::string& name, const std::string& bytes,
                                          int class_column = 0) const {
    const auto without = [this](std::string text) {
      const std::size_t at = text.find(folder_);
      return Error{at == std::string::npos ? text : text.erase(at, folder_.size() + 1)};
    };
    const auto file = open_survey_points(put(name, bytes), class_column);
    if (!file) return without(file.error().message);
    SurveyPoints all, block;
    for (int twice = 0; twice < 2; ++twice) {
      all.clear();
      if (const Outcome done = (*file)->rewind(); !done) return without(done.error().message);
      for (;;) {
        if (const Outcome done = (*file)->next(&block); !done) return without(done.error().message);
        if (block.size() == 0) break;
        for (std::size_t k = 0; k < block.size(); ++k) {
          all.add(block.x[k], block.y[k], block.z[k], block.klass[k], block.last[k] != 0,
                  block.invalid[k] != 0);
        }
      }
    }
    return all;
  }
  std::string why_not(const std::string& name, const std::string& bytes, int class_column = 0) {
    const Result<SurveyPoints> points = read(name, bytes, class_column);
    return points ? "" : points.error().message;
  }

  std::string folder_;
};

LasFile three_points(int minor, int format) {
  LasFile las;
  las.minor = minor;
  las.format = format;
  las.points = {{500001.25, 5200002.5, 300.125, 2, 1, 1, false},
                {500003.0, 5199990.0, -12.5, format < 6 ? 31 : 200, 1, 3, false},
                {499999.0, 5200000.0, 0.0, 7, 3, 3, true}};
  las.records = {{"LASF_Projection", 2112, "GEOGCS[]"}, {"other", 2112, "no"}};
  return las;
}

void change(std::size_t at, std::uint64_t value, std::size_t bytes, std::string* file) {
  std::memcpy(file->data() + at, &value, bytes);
}

TEST_F(SurveyPointsTest, EachVersionAndFormatOfLasIsRead) {
  for (const auto& [minor, last] : {std::pair{2, 3}, {3, 5}, {4, 10}}) {
    for (int format = 0; format <= last; ++format) {
      const Result<SurveyPoints> p = read("a.las", three_points(minor, format).bytes());
      ASSERT_TRUE(p) << p.error().message;
      ASSERT_EQ(p->size(), 3U) << minor << ' ' << format;
      EXPECT_NEAR(p->x[0], 500001.25, 1e-6);
      EXPECT_NEAR(p->y[1], 5199990.0, 1e-6);
      EXPECT_NEAR(p->z[1], -12.5, 1e-9);
      EXPECT_THAT(p->klass, testing::ElementsAre(2, format < 6 ? 31 : 200, 7)) << format;
      EXPECT_THAT(p->last, testing::ElementsAre(1, 0, 1)) << format;
      EXPECT_THAT(p->invalid, testing::ElementsAre(0, 0, 1)) << format;
    }
  }
}

TEST_F(SurveyPointsTest, MorePointsThanABlockAreRead) {
  LasFile las;
  las.format = 1;
  for (int k = 0; k < 150'000; ++k) las.points.push_back({500000.0 + 0.01 * k, 5200000.0, 1.0});
  const Result<SurveyPoints> p = read("many.las", las.bytes());
  ASSERT_TRUE(p) << p.error().message;
  ASSERT_EQ(p->size(), 150'000U);
  for (std::size_t k = 0; k < p->size(); ++k) {
    ASSERT_NEAR(p->x[k], 500000.0 + 0.01 * static_cast<double>(k), 1e-6);
  }
}

TEST_F(SurveyPointsTest, TheReferenceSystemIsReported) {
  const auto crs = [this](const LasFile& las) {
    const auto file = open_survey_points(put("crs.las", las.bytes()), 0);
    EXPECT_TRUE(file) << file.error().message;
    return (*file)->crs();
  };
  LasFile las = three_points(4, 6);
  EXPECT_EQ(crs(las).wkt, "GEOGCS[]");
  las.records.push_back({"LASF_Projection", 34735, "keys"});
  EXPECT_EQ(crs(las).wkt, "");
  EXPECT_EQ(crs(las).geo_keys.size(), 4U);
  las.encoding = 0x10;
  EXPECT_EQ(crs(las).wkt, "GEOGCS[]");
  EXPECT_EQ(crs(las).geo_keys.size(), 0U);
  las.records.clear();
  las.extended = {{"other", 1, std::string(100'000, 'x')},
                  {"LASF_Projection", 2112, std::string("PROJCS[]\0junk", 13)}};
  EXPECT_EQ(crs(las).wkt, "PROJCS[]");
}

TEST_F(SurveyPointsTest, AHeaderIsCheckedAgainstTheFile) {
  const std::string sound = three_points(4, 6).bytes();
  const auto with = [&](std::size_t at, std::uint64_t value, std::size_t bytes) {
    std::string file = sound;
    change(at, value, bytes, &file);
    return why_not("b.las", file);
  };
  ASSERT_EQ(why_not("b.las", sound), "");
  EXPECT_EQ(with(0, 'M', 1), "b.las: not a LAS file (no LASF)");
  EXPECT_EQ(with(25, 1, 1), "b.las: version 1.1: 1.2 to 1.4 are read");
  EXPECT_THAT(with(94, 374, 2), StartsWith("b.las: header size 374:"));
  EXPECT_THAT(with(94, 60000, 2), StartsWith("b.las: header size 60000:"));
  EXPECT_THAT(with(96, 100, 4), StartsWith("b.las: offset to point data 100:"));
  EXPECT_THAT(with(96, 0xFFFFFFFF, 4), StartsWith("b.las: offset to point data 4294967295:"));
  EXPECT_THAT(with(100, 0xFFFFFFFF, 4), HasSubstr("variable length record 3 of 4294967295"));
  EXPECT_THAT(with(104, 11, 1), StartsWith("b.las: point data format 11:"));
  EXPECT_THAT(with(105, 29, 2), StartsWith("b.las: point record length 29:"));
  EXPECT_THAT(with(105, 0, 2), StartsWith("b.las: point record length 0:"));
  EXPECT_THAT(with(107, 2, 4), HasSubstr("number of points 3: the legacy field says 2"));
  EXPECT_THAT(with(247, 4, 8), HasSubstr("number of points 4: the file has room for 3"));
  EXPECT_THAT(with(247, ~std::uint64_t{0}, 8), HasSubstr("has room for 3"));
  EXPECT_THAT(with(247, 0, 8), HasSubstr("number of points 0"));
  EXPECT_THAT(with(131, 0, 8), StartsWith("b.las: X scale factor 0:"));
  EXPECT_THAT(with(139, 0x7FF8000000000000, 8), StartsWith("b.las: Y scale factor nan:"));
  EXPECT_THAT(with(171, 0x7FF0000000000000, 8), StartsWith("b.las: Z offset inf:"));
  EXPECT_THAT(with(375 + 20, 60000, 2), HasSubstr("variable length record 1: its length 60000"));
  EXPECT_THAT(with(243, 1, 4), StartsWith("b.las: start of extended variable length records 0:"));
  LasFile las = three_points(4, 6);
  las.extended = {{"other", 1, "body"}};
  std::string file = las.bytes();
  change(file.size() - 4 - 40, ~std::uint64_t{0}, 8, &file);
  EXPECT_THAT(why_not("b.las", file), HasSubstr("extended variable length record 1: its length"));
  EXPECT_THAT(why_not("old.las", three_points(2, 4).bytes()), HasSubstr("version 1.2 has 0 to 3"));
}

TEST_F(SurveyPointsTest, ACompressedFileIsRejectedByItsName) {
  std::string file = three_points(4, 6).bytes();
  file[104] = static_cast<char>(0x80 | 6);
  EXPECT_EQ(why_not("c.laz", file),
            "c.laz: compressed (LAZ): unpack it first, e.g. laszip -i in.laz -o out.las, or pdal "
            "translate in.laz out.las");
  LasFile las = three_points(2, 1);
  las.records = {{"laszip encoded", 22204, "x"}};
  EXPECT_THAT(why_not("c.las", las.bytes()), HasSubstr("compressed"));
}

TEST_F(SurveyPointsTest, AFileTruncatedAnywhereIsRejected) {
  for (const int minor : {2, 3, 4}) {
    LasFile las = three_points(minor, minor == 4 ? 7 : 1);
    if (minor == 4) las.extended = {{"LASF_Projection", 2112, "PROJCS[]"}};
    const std::string whole = las.bytes();
    for (std::size_t n = 0; n < whole.size(); ++n) {
      std::istringstream in(whole.substr(0, n));
      const auto header = read_las_header(in, static_cast<std::int64_t>(n), "cut.las");
      ASSERT_FALSE(header) << n << " of " << whole.size();
      ASSERT_THAT(header.error().message, StartsWith("cut.las: "));
    }
  }
}

TEST_F(SurveyPointsTest, NoChangedHeaderByteDoesHarm) {
  LasFile las = three_points(4, 6);
  las.extended = {{"LASF_Projection", 2112, "PROJCS[]"}};
  const std::string sound = las.bytes();
  for (std::size_t at = 0; at < sound.size(); ++at) {
    for (const int value : {0, 1, 0x7F, 0x80, 0xFF}) {
      std::string file = sound;
      file[at] = static_cast<char>(value);
      std::istringstream in(file);
      const auto size = static_cast<std::int64_t>(file.size());
      const Result<LasHeader> header = read_las_header(in, size, "d.las");
      if (header) {
        EXPECT_GE(header->record_bytes, 20);
        EXPECT_LE(header->data_at + header->points * header->record_bytes, size) << at;
      } else {
        EXPECT_THAT(header.error().message, StartsWith("d.las: ")) << at;
      }
    }
  }
}

TEST_F(SurveyPointsTest, OtherFormatsAreRead) {
  const std::string far = "500000.25 5200000.5 300.125";
  Result<SurveyPoints> p = read("a.xyz", "# x y z\n" + far + " 9 1 1 2\r\n\n1,2;3 8 1 1 nan\n", 7);
  ASSERT_TRUE(p) << p.error().message;
  EXPECT_EQ(p->x[0], 500000.25);  // not rounded to a float
  EXPECT_THAT(p->klass, testing::ElementsAre(2, kNoClass));
  EXPECT_EQ(why_not("a.xyz", far + "\n", 4), "a.xyz:1: 3 columns, expected 4");
  EXPECT_EQ(why_not("a.xyz", far + "\n1 2 x\n"), "a.xyz:2: \"x\" is not a number");
  EXPECT_THAT(why_not("a.xyz", std::string(10'000, '1')), HasSubstr("characters in a line"));
  const std::string ply =
      "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty double y\n"
      "property double z\nproperty uchar classification\nend_header\n";
  p = read("a.ply", ply + far + " 2\n1 2 nan 5\n");
  ASSERT_TRUE(p) << p.error().message;
  EXPECT_EQ(p->y[0], 5200000.5);
  EXPECT_THAT(p->klass, testing::ElementsAre(2, 5));
  EXPECT_THAT(p->invalid, testing::ElementsAre(0, 1));
  EXPECT_THAT(why_not("a.ply", ply + far + " 2\n"), HasSubstr("1 points fewer than in the header"));
  EXPECT_THAT(why_not("a.ply", ply, 7), HasSubstr("--class-column"));
  std::string pcd =
      "VERSION 0.7\nFIELDS x y z class\nSIZE 8 8 8 1\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 1\n"
      "HEIGHT 1\nPOINTS 1\nDATA binary\n";
  const std::string head = pcd;
  for (const double v : {500000.25, 5200000.5, 300.125}) LasFile::put(pcd.size(), v, &pcd);
  pcd += '\2';
  p = read("a.pcd", pcd);
  ASSERT_TRUE(p) << p.error().message;
  EXPECT_EQ(p->x[0], 500000.25);
  EXPECT_THAT(p->klass, testing::ElementsAre(2));
  pcd.pop_back();
  EXPECT_EQ(why_not("a.pcd", pcd), "a.pcd: header has 1 points, the file 0");
  EXPECT_THAT(why_not("a.tif", far), HasSubstr("must end in .las"));
}

}  // namespace
}  // namespace rcs::clouds

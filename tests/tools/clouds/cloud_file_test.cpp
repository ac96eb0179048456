#include "tools/clouds/cloud_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cmath>
#include <cstdio>
#include <cstring>

#include "tools/clouds/survey_points.h"

namespace rcs::clouds {
namespace {

using testing::HasSubstr;

std::vector<std::uint8_t> bytes_of(const std::string& text) { return {text.begin(), text.end()}; }

template <class T>
void append(T value, std::string* out) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  out->append(raw, sizeof value);
}

Result<Cloud> parse(const std::string& text, const std::string& name, CloudShape shape = {}) {
  return parse_cloud(bytes_of(text), name, shape);
}

std::string complaint(const std::string& text, const std::string& name, CloudShape shape = {}) {
  const Result<Cloud> cloud = parse(text, name, shape);
  return cloud ? "accepted" : cloud.error().message;
}

void expect_points(const Result<Cloud>& cloud, std::size_t n) {
  ASSERT_TRUE(cloud) << cloud.error().message;
  ASSERT_EQ(cloud->points.size(), n);
  EXPECT_EQ(cloud->points[0], Vec3f(1.0F, 2.0F, 3.0F));
  EXPECT_EQ(cloud->points[n - 1], Vec3f(-4.5F, 0.25F, 100.0F));
}

TEST(CloudFile, ReadsAsciiPcd) {
  const std::string text =
      "# .PCD v0.7\nVERSION 0.7\nFIELDS intensity x y z\nSIZE 4 4 4 4\nTYPE F F F F\n"
      "COUNT 1 1 1 1\nWIDTH 4\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA ascii\n"
      "7 1 2 3\r\n8 nan nan nan\n9 0 0 0\n9 -4.5 2.5e-1 1e2\n";
  const Result<Cloud> cloud = parse(text, "a.pcd");
  expect_points(cloud, 2);
  EXPECT_EQ(cloud->no_return, 2);
  EXPECT_TRUE(cloud->cell.empty());
}

TEST(CloudFile, AFifoIsRejectedWithoutWaiting) {
  const std::string path = testing::TempDir() + "cloud_file_test.pcd";
  (void)std::remove(path.c_str());
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  EXPECT_EQ(read_cloud(path, {}).error().message, path + ": is not a regular file");
  EXPECT_EQ(open_survey_points(path, 0).error().message, path + ": is not a regular file");
  (void)std::remove(path.c_str());
}

TEST(CloudFile, CountsOfAHeaderAreLimited) {
  std::string fields = "FIELDS x y z";
  std::string sizes = "\nSIZE 4 4 4";
  std::string types = "\nTYPE F F F";
  std::string counts = "\nCOUNT 1 1 1";
  for (int k = 0; k < 1000; ++k) {
    fields += " a";
    sizes += " 8";
    types += " F";
    counts += " 10000";
  }
  EXPECT_THAT(complaint(fields + sizes + types + counts + "\nWIDTH 1\nDATA binary\n", "a.pcd"),
              HasSubstr("more than 10000 numbers per point"));
  const std::string xyz = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\n";
  EXPECT_THAT(complaint(xyz + "WIDTH 4294967296\nHEIGHT 4294967296\nDATA binary\n", "a.pcd"),
              HasSubstr("more than 2147483647"));
  EXPECT_THAT(complaint(xyz + "DATA binary\n", "a.pcd"), HasSubstr("POINTS or WIDTH is required"));
  EXPECT_THAT(complaint(xyz + "POINTS 9000000000000000000\nDATA binary\n", "a.pcd"),
              HasSubstr("the file 0"));
  EXPECT_THAT(complaint("ply\nformat binary_little_endian 1.0\nelement vertex 9000000000000000000\n"
                        "property float x\nproperty float y\nproperty float z\nend_header\n",
                        "a.ply"),
              HasSubstr("the file 0"));
}

TEST(CloudFile, ReadsBinaryPcdWithOtherFieldsAndItsOrganization) {
  std::string text =
      "FIELDS x y z normal t\nSIZE 4 4 4 8 2\nTYPE F F F F U\nCOUNT 1 1 1 3 1\n"
      "WIDTH 3\nHEIGHT 2\nPOINTS 6\nDATA binary\n";
  const std::vector<Vec3f> points = {{1, 2, 3}, {0, 0, 0}, {9, 9, 9},
                                     {0, 0, 0}, {0, 0, 0}, {-4.5F, 0.25F, 100}};
  for (const Vec3f& p : points) {
    for (int i = 0; i < 3; ++i) append(p[i], &text);
    for (int i = 0; i < 3; ++i) append(0.5, &text);
    append(std::uint16_t{7}, &text);
  }
  const Result<Cloud> cloud = parse(text, "a.pcd");
  expect_points(cloud, 3);
  EXPECT_EQ(cloud->rows, 2);
  EXPECT_EQ(cloud->cols, 3);
  EXPECT_EQ(cloud->cell, (std::vector<std::int32_t>{0, 2, 5}));
  EXPECT_THAT(complaint(text.substr(0, text.size() - 1), "a.pcd"),
              HasSubstr("header has 6 points"));
}

TEST(CloudFile, ReadsPly) {
  const std::string head =
      "ply\nformat ascii 1.0\ncomment made by hand\nelement vertex 2\nproperty float x\n"
      "property float y\nproperty uchar red\nproperty double z\nelement face 1\n"
      "property list uchar int vertex_indices\nend_header\n";
  expect_points(parse(head + "1 2 255 3\n-4.5 0.25 0 100\n3 0 1 2\n", "a.ply"), 2);

  std::string text = head;
  text.replace(text.find("ascii"), 5, "binary_little_endian");
  const std::vector<Vec3> points = {{1, 2, 3}, {-4.5, 0.25, 100}};
  for (const Vec3& p : points) {
    append(static_cast<float>(p.x()), &text);
    append(static_cast<float>(p.y()), &text);
    append(std::uint8_t{255}, &text);
    append(p.z(), &text);
  }
  expect_points(parse(text, "a.ply"), 2);
}

TEST(CloudFile, ReadsKittiAndXyz) {
  std::string bin;
  for (const float v : {1.0F, 2.0F, 3.0F, 0.5F, -4.5F, 0.25F, 100.0F, 0.1F}) append(v, &bin);
  expect_points(parse(bin, "0000000000.bin"), 2);
  EXPECT_THAT(complaint(bin + "x", "0.bin"),
              HasSubstr("0.bin: 33 bytes are 2 records and 1 bytes"));
  expect_points(parse("# x y z\n1 2 3 0.5\n\n-4.5,0.25,100\n", "a.xyz"), 2);
}

TEST(CloudFile, ATextOrEmptyFileIsNoKittiBin) {
  EXPECT_THAT(complaint("", "0.bin"), HasSubstr("0.bin: the file is empty; expected the binary"));
  // As long as two records.
  EXPECT_THAT(complaint("1.000 2.000 3.5\n4.000 5.000 6.5\n", "0.bin"),
              HasSubstr("0.bin: the file is text; expected the binary records of KITTI, 16 bytes"));
}

TEST(CloudFile, SkippedPointsAreCountedByTheirCause) {
  const float nan = std::nanf("");
  std::string bin;
  for (const float v : {1.0F, 2.0F, 3.0F,  0.5F, nan,  1.0F, 1.0F, 0.0F, 0.0F, 0.0F,
                        0.0F, 0.0F, 20e3F, 0.0F, 0.0F, 0.0F, 1.0F, nan,  1.0F, 0.0F}) {
    append(v, &bin);
  }
  const Result<Cloud> cloud = parse(bin, "0.bin");
  ASSERT_TRUE(cloud) << cloud.error().message;
  EXPECT_EQ(skipped_text(*cloud),
            "4 of 5 points skipped: 2 not finite, 1 at the origin, 1 more than 10 km from the "
            "origin");
  EXPECT_EQ(skipped_text(parse("1 2 3\n", "a.xyz").value()), "");
}

TEST(CloudFile, AGivenShapeArrangesTheRecordsInCells) {
  const Result<Cloud> cloud = parse("1 2 3\n0 0 0\n0 0 0\n-4.5 0.25 100\n", "a.xyz", {2, 2});
  expect_points(cloud, 2);
  EXPECT_EQ(cloud->cell, (std::vector<std::int32_t>{0, 3}));
  EXPECT_THAT(complaint("1 2 3\n", "a.xyz", {2, 2}), HasSubstr("1 records are not 2 x 2 cells"));
}

TEST(CloudFile, OfCoincidentPointsTheFirstIsKept) {
  const std::string text = "3 1 2\n1 2 3\n3 1 2\n0 0 0\n1 2 3.001\n3 1 2\n";
  Result<Cloud> cloud = parse_cloud({text.begin(), text.end()}, "a.xyz", CloudShape{2, 3});
  ASSERT_TRUE(cloud);
  EXPECT_EQ(drop_coincident(&cloud.value()), 2U);
  ASSERT_EQ(cloud->points.size(), 3U);
  EXPECT_EQ(cloud->points[0], Vec3f(3, 1, 2));
  EXPECT_EQ(cloud->points[1], Vec3f(1, 2, 3));
  EXPECT_EQ(cloud->points[2], Vec3f(1, 2, 3.001F));
  EXPECT_EQ(cloud->cell, (std::vector<std::int32_t>{0, 1, 4}));
  EXPECT_EQ(drop_coincident(&cloud.value()), 0U);
  Cloud none;
  EXPECT_EQ(drop_coincident(&none), 0U);
}

TEST(CloudFile, ErrorsAreNamed) {
  EXPECT_THAT(complaint("1 2 3\n1 2 three\n", "a.xyz"), HasSubstr("a.xyz:2: \"three\""));
  EXPECT_THAT(complaint("1 2\n", "a.xyz"), HasSubstr("a.xyz:1: fewer than three coordinates"));
  EXPECT_THAT(complaint("", "a.las"), HasSubstr("must end in"));
  EXPECT_THAT(complaint("", "noname"), HasSubstr("must end in"));
  EXPECT_THAT(complaint("", "a.pcd"), HasSubstr("no DATA line"));
  EXPECT_THAT(complaint("FIELDS x y\nSIZE 4 4\nTYPE F F\nPOINTS 1\nDATA ascii\n1 2\n", "a.pcd"),
              HasSubstr("no field z"));
  EXPECT_THAT(complaint("FIELDS x\nSIZE 4 4\nTYPE F\nDATA ascii\n", "a.pcd"), HasSubstr("differ"));
  EXPECT_THAT(complaint("FIELDS x\nSIZE 3\nTYPE F\nDATA ascii\n", "a.pcd"), HasSubstr("field x"));
  EXPECT_THAT(complaint("DATA binary_compressed\n", "a.pcd"), HasSubstr("ascii or binary"));
  EXPECT_THAT(complaint("POINTS -3\nDATA ascii\n", "a.pcd"), HasSubstr("POINTS"));
  EXPECT_THAT(complaint("FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 9000000000000000000\n"
                        "DATA binary\n",
                        "a.pcd"),
              HasSubstr("header has"));
  EXPECT_THAT(complaint("plx\n", "a.ply"), HasSubstr("a.ply:1: not a PLY"));
  EXPECT_THAT(complaint("ply\nformat binary_big_endian 1.0\n", "a.ply"), HasSubstr("little"));
  EXPECT_THAT(complaint("ply\nformat ascii 1.0\nelement face 2\n", "a.ply"), HasSubstr("first"));
  EXPECT_THAT(
      complaint("ply\nformat ascii 1.0\nelement vertex 1\nproperty list uchar int i\n", "a.ply"),
      HasSubstr("a.ply:4"));
  EXPECT_THAT(complaint("ply\n", "a.ply"), HasSubstr("end_header"));
  EXPECT_THAT(complaint("450000 5400000 120\n450001 5400000 120\n", "map.xyz"),
              HasSubstr("subtract a nearby origin"));
}

}  // namespace
}  // namespace rcs::clouds

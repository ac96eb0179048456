#include "rcs/ros2/cloud_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "rcs/base/byte_codec.h"
#include "rcs/ros2/point_clouds.h"

namespace rcs::ros2 {
namespace {

using testing::ElementsAre;

constexpr std::uint8_t kUint16 = 4;
constexpr std::uint8_t kUint32 = 6;
constexpr std::uint8_t kFloat32 = 7;
constexpr std::uint8_t kFloat64 = 8;
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// Points along x at 1, 2, ... m in `height` rows, with room of 8 bytes at offset 16.
msg::PointCloud2 cloud(std::uint32_t height, std::uint32_t width) {
  msg::PointCloud2 m;
  m.header = {{1000, 500'000'000}, "ladar"};
  m.height = height;
  m.width = width;
  m.point_fields = {{"x", 0, kFloat32, 1}, {"y", 4, kFloat32, 1}, {"z", 8, kFloat32, 1}};
  m.point_step = 24;
  m.row_step = 24 * width;
  m.data.resize(std::size_t{m.row_step} * height);
  for (std::size_t i = 0; i < std::size_t{height} * width; ++i) {
    wire::put(static_cast<float>(i + 1), m.data.data() + 24 * i);
  }
  return m;
}

template <class T>
void put(msg::PointCloud2* m, std::size_t point, std::size_t offset, T value) {
  wire::put(value, m->data.data() + m->point_step * point + offset);
}

CloudFault read(const msg::PointCloud2& m, CloudPoints* out) { return read_cloud(m, {}, out); }

TEST(CloudReader, ReadsRowsWithPadding) {
  msg::PointCloud2 m = cloud(2, 3);
  m.row_step = 80;
  m.data.resize(160);
  for (std::size_t i = 0; i < 3; ++i) wire::put(10.0F, m.data.data() + 80 + 24 * i);
  CloudPoints points;
  ASSERT_EQ(read(m, &points), CloudFault::kNone);
  EXPECT_THAT(points.x_m, ElementsAre(1.0F, 2.0F, 3.0F, 10.0F, 10.0F, 10.0F));
  EXPECT_TRUE(points.dt_us.empty());
}

TEST(CloudReader, TimesOfCommonDrivers) {
  struct Case {
    msg::PointField field;
    std::function<void(msg::PointCloud2*, std::size_t, double after_s)> write;
  };
  const double epoch_s = 1.7e9;
  const Case kCases[] = {
      {{"t", 16, kUint32, 1},  // Ouster
       [](auto* m, auto i, double s) { put(m, i, 16, static_cast<std::uint32_t>(s * 1e9)); }},
      {{"offset_time", 16, kUint32, 1},  // Livox
       [](auto* m, auto i, double s) { put(m, i, 16, static_cast<std::uint32_t>(s * 1e9)); }},
      {{"time", 16, kFloat32, 1},  // Velodyne
       [](auto* m, auto i, double s) { put(m, i, 16, static_cast<float>(s)); }},
      {{"timestamp", 16, kFloat64, 1},  // after the stamp
       [](auto* m, auto i, double s) { put(m, i, 16, s); }},
      {{"timestamp", 16, kFloat64, 1},  // Hesai, RoboSense
       [&](auto* m, auto i, double s) {
         m->header.stamp.sec = static_cast<std::int32_t>(epoch_s);
         put(m, i, 16, epoch_s + 0.5 + s);
       }},
      {{"timestamp", 16, kFloat64, 1},  // Livox driver 2
       [&](auto* m, auto i, double s) {
         m->header.stamp.sec = static_cast<std::int32_t>(epoch_s);
         put(m, i, 16, (epoch_s + 0.5 + s) * 1e9);
       }},
  };
  for (const Case& c : kCases) {
    msg::PointCloud2 m = cloud(1, 3);
    m.point_fields.push_back(c.field);
    for (std::size_t i = 0; i < 3; ++i) c.write(&m, i, 0.05 * static_cast<double>(i));
    CloudPoints points;
    ASSERT_EQ(read(m, &points), CloudFault::kNone) << c.field.name;
    ASSERT_EQ(points.dt_us.size(), 3U);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(points.dt_us[i], 50'000.0 * static_cast<double>(i), 2.0) << c.field.name;
    }
  }
}

TEST(CloudReader, ANegativeTimeIsBeforeTheStamp) {
  msg::PointCloud2 m = cloud(1, 2);
  m.point_fields.push_back({"time", 16, kFloat32, 1});
  put(&m, 0, 16, -0.1F);
  CloudPoints points;
  ASSERT_EQ(read(m, &points), CloudFault::kNone);
  EXPECT_THAT(points.dt_us, ElementsAre(-100'000, 0));
}

TEST(CloudReader, PointsWithoutAReturnAreOmitted) {
  msg::PointCloud2 m = cloud(1, 6);
  put(&m, 0, 0, 0.0F);  // (0, 0, 0)
  put(&m, 1, 4, kNan);
  put(&m, 2, 8, -std::numeric_limits<float>::infinity());
  put(&m, 3, 0, 1001.0F);  // beyond max_range_m
  put(&m, 4, 0, 3e38F);    // its square is beyond float
  CloudPoints points;
  ASSERT_EQ(read(m, &points), CloudFault::kNone);
  EXPECT_THAT(points.x_m, ElementsAre(6.0F));
  EXPECT_EQ(points.omitted, 5U);
}

TEST(CloudReader, EachFaultIsNamed) {
  struct Case {
    CloudFault expected;
    std::function<void(msg::PointCloud2*)> damage;
  };
  const Case kCases[] = {
      {CloudFault::kBigEndian, [](auto* m) { m->is_bigendian = true; }},
      {CloudFault::kTooManyPoints, [](auto* m) { m->height = m->width = 0xFFFFFFFF; }},
      {CloudFault::kTooManyPoints, [](auto* m) { m->width = 300'001; }},
      {CloudFault::kNoCoordinates, [](auto* m) { m->point_fields.clear(); }},
      {CloudFault::kNoCoordinates, [](auto* m) { m->point_fields[1].name = "Y"; }},
      {CloudFault::kNoCoordinates, [](auto* m) { m->point_fields[2].datatype = kUint16; }},
      {CloudFault::kNoCoordinates, [](auto* m) { m->point_fields[2].datatype = 200; }},
      {CloudFault::kPointStep, [](auto* m) { m->point_fields[2].offset = 21; }},
      {CloudFault::kPointStep, [](auto* m) { m->point_fields[0].offset = 0xFFFFFFFD; }},
      {CloudFault::kPointStep, [](auto* m) { m->point_fields[0].count = 2; }},
      {CloudFault::kPointStep, [](auto* m) { m->point_step = 0; }},
      {CloudFault::kPointStep,
       [](auto* m) {
         m->point_fields.push_back({"timestamp", 20, kFloat64, 1});
       }},
      {CloudFault::kTimeType,
       [](auto* m) {
         m->point_fields.push_back({"t", 16, kFloat32, 1});
       }},
      {CloudFault::kSize, [](auto* m) { m->point_step = 0xFFFFFFFF; }},
      {CloudFault::kSize, [](auto* m) { m->row_step = 71; }},
      {CloudFault::kSize, [](auto* m) { m->row_step = 0xFFFFFFFF; }},
      {CloudFault::kSize, [](auto* m) { m->data.pop_back(); }},
      {CloudFault::kSize, [](auto* m) { m->data.clear(); }},
      {CloudFault::kSize, [](auto* m) { m->height = 2; }},
      {CloudFault::kTimes,
       [](auto* m) {
         m->point_fields.push_back({"time", 16, kFloat32, 1});
         put(m, 1, 16, 0.6F);
       }},
      {CloudFault::kTimes,
       [](auto* m) {
         m->point_fields.push_back({"time", 16, kFloat32, 1});
         put(m, 1, 16, kNan);
       }},
      {CloudFault::kTimes,
       [](auto* m) {
         m->point_fields.push_back({"time", 16, kFloat32, 1});
         put(m, 0, 16, -0.4F);
         put(m, 1, 16, 0.4F);
       }},
      {CloudFault::kTimes,
       [](auto* m) {
         m->point_fields.push_back({"timestamp", 16, kFloat64, 1});
         put(m, 0, 16, 1e300);
       }},
      {CloudFault::kEmpty,
       [](auto* m) {
         m->height = 0;
         m->data.clear();
       }},
      {CloudFault::kEmpty,
       [](auto* m) {
         m->width = m->row_step = 0;
         m->data.clear();
       }},
      {CloudFault::kEmpty,
       [](auto* m) {
         for (std::size_t i = 0; i < 3; ++i) put(m, i, 0, kNan);
       }},
  };
  CloudPoints points;
  for (const Case& c : kCases) {
    msg::PointCloud2 m = cloud(1, 3);
    c.damage(&m);
    const CloudFault fault = read(m, &points);
    EXPECT_EQ(fault, c.expected) << name_of(fault) << " instead of " << name_of(c.expected);
  }
}

TEST(CloudReader, DamagedCloudsAreReadWithinTheirBytes) {
  // For the address sanitizer: random values in all numbers of the layout.
  std::mt19937 random(1);
  int read_clouds = 0;
  CloudPoints points;
  for (int i = 0; i < 50'000; ++i) {
    msg::PointCloud2 m = cloud(2, 3);
    m.point_fields.push_back({"t", 16, kUint32, 1});
    for (std::uint32_t* number : {&m.height, &m.width, &m.point_step, &m.row_step,
                                  &m.point_fields[0].offset, &m.point_fields[3].offset}) {
      if (random() % 4 != 0) continue;
      *number = static_cast<std::uint32_t>(random() % 3 == 0 ? random() : random() % 100);
    }
    m.data.resize(random() % 4 == 0 ? random() % 300 : m.data.size());
    m.data.shrink_to_fit();
    if (read(m, &points) == CloudFault::kNone) ++read_clouds;
  }
  EXPECT_GT(read_clouds, 1000);
}

TEST(CloudReader, ReadsWhatThisSystemPublishes) {
  CloudPart part;
  part.x_m = {1.0F, 2.0F};
  part.y_m = {3.0F, 4.0F};
  part.z_m = {5.0F, 6.0F};
  part.utime = {7'000'000, 7'000'250};
  part.ring = {1, 2};
  CloudPoints points;
  ASSERT_EQ(read(to_point_cloud(part, "ladar", {}), &points), CloudFault::kNone);
  EXPECT_EQ(points.x_m, part.x_m);
  EXPECT_EQ(points.z_m, part.z_m);
  EXPECT_THAT(points.dt_us, ElementsAre(0, 250));
}

}  // namespace
}  // namespace rcs::ros2

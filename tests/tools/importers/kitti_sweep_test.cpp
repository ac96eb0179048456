#include "tools/importers/kitti_sweep.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <set>

namespace rcs::importers {
namespace {

constexpr double kAzimuthStep_rad = 2.0 * kPi / 2000.0;

void append(std::vector<std::uint8_t>* bytes, float x, float y, float z) {
  const std::array<float, 4> point = {x, y, z, 0.5F};
  const std::size_t at = bytes->size();
  bytes->resize(at + sizeof point);
  std::memcpy(bytes->data() + at, point.data(), sizeof point);
}

/// 64 rows from the top down, each counter-clockwise from straight ahead; row r lacks its first r
/// and last r returns, as the lowest rows of a real sweep do. Range and height identify row and
/// position.
std::vector<std::uint8_t> organized_sweep() {
  std::vector<std::uint8_t> bytes;
  for (int r = 0; r < kSweepRows; ++r) {
    for (int c = r; c < 2000 - r; ++c) {
      const double azimuth_rad = (c + 0.5) * kAzimuthStep_rad;
      append(&bytes, static_cast<float>(20.0 * std::cos(azimuth_rad)),
             static_cast<float>(20.0 * std::sin(azimuth_rad)), static_cast<float>(-0.1 * r));
    }
  }
  return bytes;
}

const SweepTiming kTiming = {7, from_utime(725'200), from_seconds(0.1036), true};

TEST(KittiSweep, RowsRestartWhereTheAzimuthWraps) {
  const Result<Sweep> sweep = parse_sweep(organized_sweep(), "memory");
  ASSERT_TRUE(sweep.ok()) << sweep.error().message;
  ASSERT_TRUE(sweep->organized());
  for (std::size_t i = 0; i < sweep->points_ladar.size(); ++i) {
    const int from_top = static_cast<int>(std::lround(-10.0F * sweep->points_ladar.z[i]));
    ASSERT_EQ(sweep->row[i], kSweepRows - 1 - from_top);
  }
}

TEST(KittiSweep, AReturnStraightAheadRoundedToMinusZeroEndsItsRow) {
  std::vector<std::uint8_t> bytes = organized_sweep();
  append(&bytes, 20.0F, -0.0F, -6.3F);  // the real sweep 42 ends like this
  const Result<Sweep> sweep = parse_sweep(bytes, "memory");
  ASSERT_TRUE(sweep.ok());
  ASSERT_TRUE(sweep->organized());
  EXPECT_EQ(sweep->row.back(), 0);
}

TEST(KittiSweep, ColumnsAndPhaseRunClockwiseFromTheRear) {
  std::vector<std::uint8_t> bytes;
  append(&bytes, -5.0F, 0.001F, 0.0F);   // rear left: the beginning
  append(&bytes, 0.0F, 5.0F, 0.0F);      // left
  append(&bytes, 5.0F, 0.0F, 0.0F);      // ahead: the middle
  append(&bytes, 0.0F, -5.0F, 0.0F);     // right
  append(&bytes, -5.0F, -0.001F, 0.0F);  // rear right: the end
  const Result<Sweep> sweep = parse_sweep(bytes, "memory");
  ASSERT_TRUE(sweep.ok());
  const std::array<double, 5> expected = {0.0, 0.25, 0.5, 0.75, 1.0};
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_NEAR(sweep->phase[i], expected[i], 1e-4);
    EXPECT_LT(sweep->phase[i], 1.0);
  }
}

TEST(KittiSweep, FacetsHoldEveryPointOnceAndInOrderOfTime) {
  const Result<Sweep> sweep = parse_sweep(organized_sweep(), "memory");
  ASSERT_TRUE(sweep.ok());
  const Result<std::vector<ladar_points_t>> facets = slice_sweep(*sweep, kTiming);
  ASSERT_TRUE(facets.ok()) << facets.error().message;
  ASSERT_EQ(facets->size(), static_cast<std::size_t>(kSweepFacets));

  std::multiset<std::array<float, 3>> sliced;
  std::int64_t last_utime = 0;
  for (const ladar_points_t& f : *facets) {
    EXPECT_GT(f.utime, last_utime);
    last_utime = f.utime;
    EXPECT_EQ(f.scan_id, 7);
    EXPECT_EQ(f.reference_utime, 725'200 + 51'800);
    EXPECT_LE(static_cast<std::size_t>(f.getEncodedSize()), kMaxDatagramBytes);
    const Stamp end = facet_end(kTiming, f.facet);
    for (std::size_t i = 0; i < f.x_m.size(); ++i) {
      sliced.insert({f.x_m[i], f.y_m[i], f.z_m[i]});
      EXPECT_GE(f.dt_us[i], 0);
      EXPECT_LE(from_utime(f.utime + f.dt_us[i]), end);
    }
  }
  std::multiset<std::array<float, 3>> given;
  for (std::size_t i = 0; i < sweep->points_ladar.size(); ++i) {
    const Vec3f p = sweep->points_ladar[i];
    given.insert({p.x(), p.y(), p.z()});
  }
  EXPECT_EQ(sliced, given);
  EXPECT_EQ(facet_end(kTiming, kSweepFacets - 1), kTiming.start + kTiming.period);
}

TEST(KittiSweep, WithoutPointTimesAllPointsHaveTheReferenceTime) {
  SweepTiming timing = kTiming;
  timing.point_times = false;
  const Result<std::vector<ladar_points_t>> facets =
      slice_sweep(parse_sweep(organized_sweep(), "memory").value(), timing);
  ASSERT_TRUE(facets.ok());
  for (const ladar_points_t& f : *facets) EXPECT_EQ(f.n_time, 0);
}

TEST(KittiSweep, InvalidBytesAreCountedOrRejected) {
  EXPECT_EQ(parse_sweep(std::vector<std::uint8_t>(17), "a.bin").error().message,
            "a.bin: 17 bytes are 1 records and 1 bytes; expected the binary records of KITTI, 16 "
            "bytes each (x, y, z, intensity as float32)");
  std::vector<std::uint8_t> bytes;
  append(&bytes, std::numeric_limits<float>::quiet_NaN(), 1.0F, 1.0F);
  append(&bytes, 0.0F, 0.0F, 0.0F);
  append(&bytes, 3.0F, 0.0F, 0.0F);
  const Result<Sweep> sweep = parse_sweep(bytes, "memory");
  ASSERT_TRUE(sweep.ok());
  EXPECT_EQ(sweep->not_finite, 1);
  EXPECT_EQ(sweep->no_return, 1);
  EXPECT_EQ(sweep->points_ladar.size(), 1U);
  EXPECT_FALSE(sweep->organized());
}

TEST(KittiSweep, ASectorLargerThanADatagramIsRejected) {
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < 4000; ++i) append(&bytes, 5.0F, 1.0F, 0.001F * static_cast<float>(i));
  EXPECT_FALSE(slice_sweep(parse_sweep(bytes, "memory").value(), kTiming).ok());
}

TEST(KittiSweep, FixesLieAtTheEarthPositionOfFrameOdom) {
  const OdomOrigin origin = {{radians(49.0), radians(8.4), {112.8}}, 0.0, 0.0, kPi / 2.0};
  // 10 m ahead of an IMU that faces north.
  const gps_fix_t fix = to_fix({Quat::Identity(), Vec3(10, 0, 0)}, origin, from_utime(5), 0.5);
  const Vec3 p_world = LocalFrame(origin.place)
                           .to_world({radians(fix.lat_deg), radians(fix.lon_deg), {fix.height_m}});
  EXPECT_LT((p_world - Vec3(0, 10, 0)).norm(), 1e-6);
  EXPECT_EQ(fix.utime, 5);
  EXPECT_EQ(fix.has_velocity, 0);
}

TEST(KittiSweep, CalibrationIsInverted) {
  const Result<Pose> T =
      parse_imu_to_velo("calib_time: now\nR: 0 -1 0 1 0 0 0 0 1\nT: 1 2 3\n", "c");
  ASSERT_TRUE(T.ok()) << T.error().message;
  // p_ladar = R p_vehicle + T: the ladar's origin in the vehicle is -R^T T.
  EXPECT_LT((T->p - Vec3(-2, 1, -3)).norm(), 1e-12);
  EXPECT_FALSE(parse_imu_to_velo("R: 1 2\nT: 1 2 3\n", "c").ok());
}

/// The real sweeps are packed; this test unpacks one with tar.
TEST(KittiSweep, RealSweepsHave64Rows) {
  const char* data = std::getenv("RCS_DATA_DIR");
  if (data == nullptr) GTEST_SKIP() << "RCS_DATA_DIR is not set: no KITTI sweeps";
  const std::filesystem::path archive =
      std::filesystem::path(data) / "kitti_2011_09_26_drive_0005" / "velodyne_bin_000-079.tar.xz";
  if (!std::filesystem::exists(archive)) GTEST_SKIP() << archive << " is missing";
  const std::filesystem::path dir = ::testing::TempDir() + "kitti_sweep_test";
  std::filesystem::create_directories(dir);
  const std::string command = "tar xJf '" + archive.string() + "' -C '" + dir.string() +
                              "' --occurrence=1 --wildcards '*0000000000.bin' '*0000000001.bin'";
  ASSERT_EQ(std::system(command.c_str()), 0);  // NOLINT(cert-env33-c): fixed words, quoted paths
  for (const char* name : {"0000000000.bin", "0000000001.bin"}) {
    std::ifstream file(dir / name, std::ios::binary);
    const std::vector<std::uint8_t> bytes((std::istreambuf_iterator<char>(file)), {});
    const Result<Sweep> sweep = parse_sweep(bytes, name);
    ASSERT_TRUE(sweep.ok()) << sweep.error().message;
    EXPECT_TRUE(sweep->organized());
    EXPECT_GT(sweep->points_ladar.size(), 100'000U);
    EXPECT_EQ(sweep->points_ladar.size() + static_cast<std::size_t>(sweep->no_return),
              bytes.size() / 16);
    EXPECT_TRUE(slice_sweep(*sweep, kTiming).ok());
  }
  std::filesystem::remove_all(dir);
}

}  // namespace
}  // namespace rcs::importers

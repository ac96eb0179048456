#include "tools/studies/kitti_drive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "rcs/base/check.h"

namespace rcs::studies {
namespace {

using testing::HasSubstr;

Vec3f at(double azimuth_deg, double elevation_deg, double range_m) {
  const double a = radians(azimuth_deg);
  const double e = radians(elevation_deg);
  return (range_m * Vec3(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)))
      .cast<float>();
}

TEST(RealCut, KeepsTheReturnNearestToTheMiddleOfItsCell) {
  // Cells are 0.444 deg wide and 0.625 deg high; one has its middle at 39.778, -17.6875 deg.
  Points sweep;
  sweep.push_back(at(39.95, -17.7, 5.0));
  sweep.push_back(at(39.80, -17.7, 6.0));
  sweep.push_back(at(39.60, -17.7, 7.0));
  sweep.push_back(at(0.1, 0.1, 8.0));
  const Points cut = real_cut(sweep);
  ASSERT_EQ(cut.size(), 2U);
  EXPECT_EQ(cut[0], sweep[1]);
  EXPECT_EQ(cut[1], sweep[3]);
}

TEST(RealCut, OmitsPointsOutsideTheRangeImage) {
  Points sweep;
  for (const double azimuth_deg : {-180.0, -40.1, 40.1, 90.0}) {
    sweep.push_back(at(azimuth_deg, -5.0, 10.0));
  }
  sweep.push_back(at(0.0, 2.1, 10.0));
  sweep.push_back(at(0.0, -18.1, 10.0));
  EXPECT_TRUE(real_cut(sweep).empty());
}

TEST(Deskew, ASurfaceSeenWhileDrivingIsMovedToTheMiddleOfTheSweep) {
  // The vehicle moves by T from one sweep to the next; p is at rest.
  const Pose T{exp_so3(Vec3(0.0, 0.01, 0.05)), Vec3(1.0, 0.1, 0.0)};
  const Vec3 p(10.0, -4.0, 1.0);
  importers::Sweep sweep;
  for (const double phase : {0.0, 0.25, 0.5, 0.75}) {
    const Pose T_middle_shot = exp_se3((phase - 0.5) * log_se3(T));
    sweep.points_ladar.push_back((T_middle_shot.inverse() * p).cast<float>());
    sweep.phase.push_back(phase);
  }
  const Points out = deskew(sweep, T);
  for (std::size_t i = 0; i < out.size(); ++i) {
    EXPECT_LT((out[i].cast<double>() - p).norm(), 1e-5) << i;  // float at 10 m
  }
}

TEST(ReferencePairs, AreReadAndErrorsAreNamed) {
  const std::string header = "model_frame,data_frame,T00\n";
  const std::string row = "3,23,0,-1,0,5,1,0,0,6,0,0,1,7,0.02,0.1\n";
  const Result<std::vector<ScanPair>> pairs = parse_reference_pairs(header + row + row, "a.csv");
  ASSERT_TRUE(pairs) << pairs.error().message;
  ASSERT_EQ(pairs->size(), 2U);
  EXPECT_EQ((*pairs)[0].model, 3);
  EXPECT_EQ((*pairs)[0].data, 23);
  EXPECT_LT(((*pairs)[0].T_model_data * Vec3(1, 0, 0) - Vec3(5, 7, 7)).norm(), 1e-12);

  const auto complaint = [&](const std::string& bad) {
    const Result<std::vector<ScanPair>> r = parse_reference_pairs(header + row + bad, "a.csv");
    return r ? "accepted" : r.error().message;
  };
  EXPECT_THAT(complaint("1,2,3\n"), HasSubstr("a.csv:3: expected 16 numbers"));
  EXPECT_THAT(complaint("3,x,0,-1,0,5,1,0,0,6,0,0,1,7,0.02,0.1\n"), HasSubstr("a.csv:3"));
  EXPECT_THAT(complaint("3,-2,0,-1,0,5,1,0,0,6,0,0,1,7,0.02,0.1\n"), HasSubstr("two scans"));
  EXPECT_THAT(complaint("3,4,0,-2,0,5,1,0,0,6,0,0,1,7,0.02,0.1\n"), HasSubstr("a motion"));
}

TEST(KittiDrive, OpensAFolderOfSweepsAndReportsMissingFiles) {
  std::string folder = (std::filesystem::temp_directory_path() / "rcs_drive_XXXXXX").string();
  RCS_CHECK(mkdtemp(folder.data()) != nullptr);
  EXPECT_FALSE(KittiDrive::open(folder));
  std::ofstream(folder + "/reference_pairs.csv") << "header\n0,1,1,0,0,0,0,1,0,0,0,0,1,0,0,0\n";
  const float one_point[] = {10.0F, 0.0F, -1.0F, 0.5F};
  std::ofstream(folder + "/0000000000.bin", std::ios::binary)
      .write(reinterpret_cast<const char*>(one_point), sizeof one_point);
  {
    const Result<KittiDrive> drive = KittiDrive::open(folder);
    ASSERT_TRUE(drive) << drive.error().message;
    const Result<importers::Sweep> sweep = drive->sweep(0);
    ASSERT_TRUE(sweep) << sweep.error().message;
    EXPECT_EQ(sweep->points_ladar.size(), 1U);
    const Result<ScanSet> cuts = drive->real_cuts(drive->references());
    ASSERT_FALSE(cuts);
    EXPECT_THAT(cuts.error().message, HasSubstr("0000000001.bin"));
  }
  std::ofstream(folder + "/velodyne_bin_000-079.tar.xz") << "no archive";
  const Result<KittiDrive> drive = KittiDrive::open(folder);
  ASSERT_FALSE(drive);
  EXPECT_THAT(drive.error().message, HasSubstr("failed to unpack"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace rcs::studies

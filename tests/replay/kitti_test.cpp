// The 80 real sweeps of KITTI's drive 0005 through import, replay and export, with the commands of
// a user.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

#include "rcs/base/pose.h"
#include "tests/replay/real_data.h"

namespace rcs::test {
namespace {

std::string rcs_command() {
  const char* folder = std::getenv("RCS_BIN_DIR");
  return std::string(folder == nullptr ? "." : folder) + "/rcs ";
}

void must(const std::string& command) {
  ASSERT_EQ(std::system((command + " >/dev/null 2>&1").c_str()), 0) << command;  // NOLINT
}

std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Rows of 3 x 4 numbers.
std::vector<Pose> kitti_rows(const std::string& path) {
  std::ifstream in(path);
  std::vector<Pose> poses;
  std::string line;
  while (std::getline(in, line)) {
    std::istringstream row(line);
    Eigen::Matrix<double, 3, 4> m;
    for (int i = 0; i < 12; ++i) row >> m(i / 4, i % 4);
    const Mat3 R = m.leftCols<3>();
    poses.push_back({Quat(R).normalized(), m.col(3)});
  }
  return poses;
}

constexpr std::size_t kSettled = 5;

class Kitti : public testing::Test {
 protected:
  // The data is unpacked and imported once for all tests.
  static void SetUpTestSuite() {
    folder_ = unpacked("kitti_2011_09_26_drive_0005/velodyne_bin_000-079.tar.xz");
    if (folder_.empty()) return;
    const std::string data = data_path("kitti_2011_09_26_drive_0005");
    truth_ = data + "/poses/oxts_imu_poses_kitti.txt";
    must(rcs_command() + "import kitti --scans " + folder_ + " --poses " + truth_ + " --calib " +
         data + "/calib -o " + folder_ + "/drive.log");
    replay("a");
    replay("b");
  }
  static void TearDownTestSuite() {
    if (!folder_.empty()) std::filesystem::remove_all(folder_);
  }
  void SetUp() override {
    if (folder_.empty()) GTEST_SKIP() << kNoData;
  }
  static void replay(const std::string& name) {
    const char* source = std::getenv("RCS_SOURCE_DIR");
    must(rcs_command() + "replay " + (source == nullptr ? "." : source) + "/config/kitti.toml " +
         folder_ + "/drive.log -o " + folder_ + "/" + name + ".log");
  }
  static std::vector<Pose> exported(const std::string& frame) {
    const std::string path = folder_ + "/" + frame + ".kitti";
    must(rcs_command() + "eval " + folder_ + "/a.log --export " + path + " --frame " + frame);
    return kitti_rows(path);
  }
  static void the_same_log_gives_the_same_bytes();
  static void the_smooth_pose_is_as_good_as_the_registrations();
  static void motion_over_10_frames_agrees_with_gps_ins_within_its_own_quality();

  inline static std::string folder_;
  inline static std::string truth_;
};

// One test: CTest runs each test in a process of its own, which would import again.
TEST_F(Kitti, ImportReplayAndExportAreConsistent) {
  SCOPED_TRACE(folder_);
  the_same_log_gives_the_same_bytes();
  the_smooth_pose_is_as_good_as_the_registrations();
  motion_over_10_frames_agrees_with_gps_ins_within_its_own_quality();
}

void Kitti::the_same_log_gives_the_same_bytes() {
  const std::string a = bytes_of(folder_ + "/a.log");
  EXPECT_GT(a.size(), 1'000'000U);
  EXPECT_TRUE(a == bytes_of(folder_ + "/b.log"));
}

void Kitti::the_smooth_pose_is_as_good_as_the_registrations() {
  // The frame local must not lag or drift relative to the map that SP builds. (Without an INS the
  // first scans meet a vehicle of unknown speed: the smooth pose converges.)
  const std::vector<Pose> local = exported("local");
  const std::vector<Pose> rolling = exported("rolling");
  ASSERT_EQ(local.size(), 80U);
  ASSERT_EQ(rolling.size(), 80U);
  const Pose T_local_rolling = local.back() * rolling.back().inverse();
  for (std::size_t i = kSettled; i < local.size(); ++i) {
    EXPECT_LT((local[i].p - T_local_rolling * rolling[i].p).norm(), 0.05) << i;
  }
}

void Kitti::motion_over_10_frames_agrees_with_gps_ins_within_its_own_quality() {
  // README of the data: over 10 frames registrations differ from OXTS by 0.1-0.4 m, 0.09-0.21 deg.
  const std::vector<Pose> local = exported("local");
  const std::vector<Pose> truth = kitti_rows(truth_);
  ASSERT_EQ(truth.size(), local.size());
  for (std::size_t i = kSettled; i + 10 < local.size(); ++i) {
    const Pose ours = local[i].inverse() * local[i + 10];
    const Pose theirs = truth[i].inverse() * truth[i + 10];
    EXPECT_LT((ours.p - theirs.p).norm(), 0.6) << i;
    EXPECT_LT(degrees(log_so3(ours.q.conjugate() * theirs.q).norm()), 0.5) << i;
  }
}

}  // namespace
}  // namespace rcs::test

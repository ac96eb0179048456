// `rcs outages` and drills on real recordings, on the command line; the tables of
// docs/experiments/faults/outages_on_recordings.md. The assertions guard against regressions; the
// tables show the accuracy.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/replay/real_data.h"
#include "tests/support/rcs_command.h"
#include "tools/base/files.h"
#include "tools/base/trajectory.h"

namespace rcs::test {
namespace {

using nlohmann::json;

class OutagesOnRealData : public RcsCommand {
 protected:
  static std::string config(const std::string& name) {
    return variable("RCS_SOURCE_DIR") + "/config/" + name;
  }
  [[nodiscard]] std::string log() const { return folder_ + "/in.log"; }

  void import(const std::string& what) {
    ASSERT_EQ(rcs("import " + what + " -o " + log()), 0) << messages();
  }
  /// Prints the tables. @return the statistics
  json outages(const std::string& vehicle, const std::string& options) {
    const std::string command =
        fmt::format("outages {} --config {} {}", log(), config(vehicle), options);
    EXPECT_EQ(rcs(command), 0) << messages();
    fmt::print("{} {}\n{}{}\n", vehicle, options, out(), messages());
    EXPECT_EQ(rcs(command + " --json"), 0) << messages();
    return json::parse(out());
  }
  static const json& group(const json& report, const std::string& sources, double length_s) {
    for (const json& g : report["groups"]) {
      if (g["sources"] == sources && g["length_s"] == length_s) return g;
    }
    ADD_FAILURE() << "no outages of " << length_s << " s with " << sources;
    return report["groups"][0];
  }
  static double median_m(const json& group, const std::string& estimator) {
    return group["horizontal_m"][estimator]["median"].get<double>();
  }
  static double worst_m(const json& group, const std::string& estimator) {
    return group["horizontal_m"][estimator]["worst"].get<double>();
  }
};

TEST_F(OutagesOnRealData, TheCommaMinute) {
  const std::string data = data_path("gps_imu_comma2k19");
  if (data.empty()) GTEST_SKIP() << kNoData;
  import("comma2k19 " + data);
  const json report = outages("comma2k19.toml", "--length 10,20,30 --places 10 --without odometry");
  EXPECT_EQ(report["reference"], "SIM_TRUTH of the log");
  EXPECT_EQ(report["gps_accepted_share"], 1.0);
  for (const double length_s : {10.0, 20.0, 30.0}) {
    const json& wheels = group(report, "all sources", length_s);
    const json& without = group(report, "without odometry", length_s);
    EXPECT_EQ(wheels["evaluated"], 10);
    EXPECT_EQ(without["evaluated"], 10);
    EXPECT_LT(median_m(wheels, "WM"), median_m(wheels, "INS alone"));
    EXPECT_LT(median_m(without, "WM"), median_m(without, "gyro, speed held"));
    EXPECT_LT(worst_m(wheels, "WM"), 0.02 * 16.7 * length_s);
  }
}

TEST_F(OutagesOnRealData, TheHuskyLoopWithoutGpsInItsMiddle) {
  const std::string data = data_path("gps_imu_husky");
  if (data.empty()) GTEST_SKIP() << kNoData;
  const std::string test1 = " " + data + "/test1_";
  import("imu-gps" + test1 + "imu.csv" + test1 + "fix.csv" + test1 + "odom.csv --columns " +
         config("import/husky.toml"));
  const json report = outages("husky.toml", "--cut 137.5,257.5");
  const json& closure = report["closures"][0];
  // With GPS throughout, the final error against the fixes is within their accuracy of 2 to 5 m.
  EXPECT_NEAR(closure["start_to_end_m"]["WM with GPS"].get<double>(),
              closure["fixes_m"].get<double>(), 5.0);
  EXPECT_LT(report["outages"][0]["at_end"]["WM"]["horizontal_m"].get<double>(), 0.15 * 108.0);
  (void)outages("husky.toml", "--length 10,30 --places 10 --from 45");
}

TEST_F(OutagesOnRealData, TheLongDresdenDrive) {
  const std::string data = data_path("gps_imu_balzer82");
  if (data.empty()) GTEST_SKIP() << kNoData;
  import("imu-gps " + data + "/2014-03-26-000-Data.csv --columns " +
         config("import/balzer82.toml"));
  const json report = outages("balzer82.toml", "--length 10,30 --places 10");
  EXPECT_EQ(group(report, "all sources", 30.0)["evaluated"], 10);
  EXPECT_GT(report["gps_accepted_share"].get<double>(), 0.99);
}

std::vector<Pose> poses_of(const std::string& path) {
  const Result<std::string> text = tools::read_text(path);
  EXPECT_TRUE(text);
  const Result<std::vector<Pose>> poses = tools::parse_kitti(*text, path);
  EXPECT_TRUE(poses);
  return *poses;
}

class KittiWithoutGps : public OutagesOnRealData {
 protected:
  /// T_20_70: the motion from frame 20 to frame 70.
  Pose motion(const std::string& run, const std::string& frame) {
    const std::string path = folder_ + "/poses.kitti";
    EXPECT_EQ(
        rcs("eval " + folder_ + "/runs/" + run + ".log --export " + path + " --frame " + frame), 0)
        << messages();
    const std::vector<Pose> poses = poses_of(path);
    return poses[20].inverse() * poses[70];
  }
};

TEST_F(KittiWithoutGps, FromFrame20To70ThePoseIsThatOfTheLadar) {
  const std::string scans = unpacked("kitti_2011_09_26_drive_0005/velodyne_bin_000-079.tar.xz");
  if (scans.empty()) GTEST_SKIP() << kNoData;
  const std::string data = data_path("kitti_2011_09_26_drive_0005");
  const std::string oxts = data + "/poses/oxts_imu_poses_kitti.txt";
  import("kitti --scans " + scans + " --poses " + oxts + " --calib " + data + "/calib");
  std::filesystem::remove_all(scans);
  // The fixes of frames 20 to 69.
  (void)outages("kitti.toml", "--from 2 --cut 2.06,7.3 --logs " + folder_ + "/runs");
  const Pose cut = motion("gps_cut_5.24s_at_2.1s", "local");
  const Pose with_gps = motion("with_gps", "local");
  const Pose ladar = motion("no_gps", "rolling");
  const std::vector<Pose> truth = poses_of(oxts);
  const Pose moved = truth[20].inverse() * truth[70];
  const auto tell = [&](const char* name, const Pose& other) {
    const Pose off = cut.inverse() * other;
    const double off_deg = degrees(log_so3(off.q).norm());
    fmt::print("frame 20 to 70, {:.2f} m, GPS cut: {:.3f} m and {:.3f} deg from {}\n", cut.p.norm(),
               off.p.norm(), off_deg, name);
    return off.p.norm();
  };
  EXPECT_LT(tell("the run with GPS", with_gps), 0.05);
  EXPECT_LT(tell("the LADAR's registrations of a run without GPS", ladar), 0.05);
  // The accuracy of OXTS there: 0.5 m and 5 % of the distance (README of the data).
  EXPECT_LT(tell("OXTS", moved), 0.5 + 0.05 * moved.p.norm());

  // Later WM has a heading accurate to two degrees.
  (void)outages("kitti.toml", "--from 4 --cut 4,7.3");

  const std::string drill =
      fmt::format("drill {{}} --log {} --config {}", log(), config("kitti.toml"));
  EXPECT_EQ(rcs(fmt::format(drill, config("drills_on_logs/kitti_jump_10m.toml"))), 0) << messages();
  fmt::print("{}", out());
  (void)rcs(fmt::format(drill, config("drills_on_logs/kitti_ramp_1.toml")) + " --json");
  const json ramp = json::parse(out())["drills"][0];
  for (const json& limit : ramp["limits"]) fmt::print("ramp of 1 m/s: {}\n", limit.dump());
}

}  // namespace
}  // namespace rcs::test

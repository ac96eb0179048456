// `rcs import comma2k19` and `rcs import imu-gps` on the command line, then replay and eval; on
// synthetic files, and on the recordings if RCS_DATA_DIR has them.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/node/log/log_file.h"
#include "tests/replay/real_data.h"
#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr const char* kHuskyImu = "t,qx,qy,qz,qw,wx,wy,wz,ax,ay,az\n";
constexpr const char* kHuskyFix = "t,status,lat_deg,lon_deg,alt_m,cov_e,cov_n,cov_u\n";
constexpr const char* kHuskyOdom = "t,px,py,pz,qx,qy,qz,qw,vx,vy,vz,wx,wy,wz\n";

class ImportRecording : public RcsCommand {
 protected:
  static std::string config(const std::string& name) {
    return variable("RCS_SOURCE_DIR") + "/config/" + name;
  }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ + "/" + name) << text;
    return folder_ + "/" + name + " ";
  }
  /// A vehicle like the Husky that drives east at 1 m/s, its IMU mounted like that one's.
  [[nodiscard]] std::string husky_files() const {
    std::string imu = kHuskyImu, fix = kHuskyFix, odom = kHuskyOdom;
    for (int k = 0; k < 1200; ++k) {
      imu += fmt::format("{:.4f},0,0,0,1,0,0,0,0,{},0\n", 1e6 + k / 30.0, 9.8);
    }
    for (int k = 0; k < 100; ++k) {
      fix += fmt::format("{:.4f},1,42.0,{:.9f},7,0.01,0.01,0.04\n", 1e6 + 0.4 * k,
                         -71.0 + 0.4 * k / 82'900.0);
    }
    for (int k = 0; k < 400; ++k) {
      odom += fmt::format("{:.4f},0,0,0,0,0,0,1,1,0,0,0,0,0\n", 1e6 + 0.1 * k);
    }
    return write("a_imu.csv", imu) + write("a_fix.csv", fix) + write("a_odom.csv", odom);
  }
  [[nodiscard]] std::string husky_import(const std::string& files) const {
    return "import imu-gps " + files + "--columns " + config("import/husky.toml") + " -o " +
           folder_ + "/in.log ";
  }
  int replay(const std::string& vehicle) {
    return rcs("replay " + config(vehicle) + " " + folder_ + "/in.log -o " + folder_ + "/out.log");
  }
  /// Share of GPS positions that WM accepted, and whether its world pose is valid.
  struct Taken {
    int fixes = 0;
    int accepted = 0;
    nav_state_t last{};
  };
  [[nodiscard]] Taken taken() const {
    Taken t;
    Result<LogReader> log = LogReader::open(folder_ + "/out.log");
    EXPECT_TRUE(log);
    LogEvent e;
    innovation_t innovation{};
    while (log && log->next(&e)) {
      const int size = static_cast<int>(e.data.size());
      if (e.channel == channel::kWmNavState) (void)t.last.decode(e.data.data(), 0, size);
      if (e.channel != channel::kWmInnovation) continue;
      (void)innovation.decode(e.data.data(), 0, size);
      if (innovation.source != 0) continue;
      ++t.fixes;
      t.accepted += innovation.accepted;
    }
    return t;
  }
};

TEST_F(ImportRecording, ThreeFilesBecomeOneLogThatWmFollows) {
  const std::string files = husky_files();
  ASSERT_EQ(rcs(husky_import(files) + "--json"), 0) << messages();
  const json counts = json::parse(out());
  EXPECT_EQ(counts["INS"]["written"], 1199);
  EXPECT_EQ(counts["GPS_FIX"]["written"], 100);
  EXPECT_EQ(counts["ODOMETRY"]["written"], 400);
  const std::string first = text_of(folder_ + "/in.log");
  ASSERT_EQ(rcs(husky_import(files)), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("INS: 1199 of 1200 rows; skipped for missing cells: 0"));
  EXPECT_TRUE(first == text_of(folder_ + "/in.log")) << "the same files, the same bytes";

  ASSERT_EQ(replay("husky.toml"), 0) << messages();
  const Taken t = taken();
  EXPECT_GT(t.accepted, 50);
  EXPECT_EQ(t.last.world_valid, 1);
  EXPECT_NEAR(std::hypot(t.last.v_world_mps[0] - 1.0, t.last.v_world_mps[1]), 0.0, 0.1);
  // Without a LADAR its poses are WM's.
  ASSERT_EQ(rcs("eval " + folder_ + "/out.log --export " + folder_ + "/out.tum"), 0) << messages();
  EXPECT_GT(text_of(folder_ + "/out.tum").size(), 1000U);
}

TEST_F(ImportRecording, ErrorsAreReportedAndNoFileIsLeft) {
  const std::string imu = write("a_imu.csv", std::string(kHuskyImu) + "1,0,0,0,1,0,0,0,0,x,0\n");
  const std::string fix = write("a_fix.csv", kHuskyFix);
  const std::string odom = write("a_odom.csv", kHuskyOdom);
  EXPECT_EQ(rcs(husky_import(imu + fix + odom)), 3);
  EXPECT_THAT(messages(), HasSubstr("a_imu.csv:2: column 'ay': 'x' is not a number"));
  EXPECT_EQ(rcs(husky_import(imu + fix)), 3);
  EXPECT_EQ(rcs(husky_import(write("a_imu.csv", kHuskyImu) + fix + odom)), 3);
  EXPECT_THAT(messages(), HasSubstr("nothing is written"));
  EXPECT_FALSE(std::filesystem::exists(folder_ + "/in.log"));
  EXPECT_EQ(rcs(husky_import("")), 2);
  EXPECT_EQ(rcs("import imu-gps " + imu), 2);
  EXPECT_EQ(rcs("import comma2k19 " + folder_ + " -o " + folder_ + "/in.log"), 3);
  EXPECT_THAT(messages(), HasSubstr("imu_acc.csv"));
  EXPECT_EQ(rcs("import comma2k19 " + folder_ + "/nothing -o x.log"), 3);
  EXPECT_EQ(rcs("import comma2k19 " + folder_ + " -o x.log --mount-rpy-deg 1,2"), 2);
  EXPECT_EQ(rcs("import comma2k19 --help"), 0);
  EXPECT_THAT(out(), HasSubstr("--gps-latency"));
  EXPECT_EQ(rcs("import imu-gps --help"), 0);
  EXPECT_THAT(out(), HasSubstr("config/import/husky.toml"));
}

TEST_F(ImportRecording, TheCommaMinuteIsFollowedBetterThanByItsReceiver) {
  const std::string data = data_path("gps_imu_comma2k19");
  if (data.empty()) GTEST_SKIP() << kNoData;
  ASSERT_EQ(rcs("import comma2k19 " + data + " -o " + folder_ + "/in.log --json"), 0) << messages();
  const json counts = json::parse(out());
  EXPECT_EQ(counts["INS"]["written"], 6255);
  EXPECT_EQ(counts["GPS_FIX"]["written"], 579);
  EXPECT_EQ(counts["ODOMETRY"]["written"], 4974);
  EXPECT_EQ(counts["SIM_TRUTH"]["written"], 1200);
  // The defaults are the estimates from the first 20 s.
  const json& check = counts["first_20_s"];
  EXPECT_NEAR(check["gps_latency_s"].get<double>(), 0.0, 5e-3);
  EXPECT_NEAR(check["mount_pitch_deg"].get<double>(), 0.0, 0.05);
  EXPECT_NEAR(check["mount_yaw_deg"].get<double>(), 0.0, 0.05);

  ASSERT_EQ(replay("comma2k19.toml"), 0) << messages();
  ASSERT_EQ(rcs("eval " + folder_ + "/out.log --from 20 --json"), 0) << messages();
  const json world = json::parse(out())["world"];
  // The receiver itself: 1.47 m.
  EXPECT_LT(world["horizontal_m"]["rms"].get<double>(), 0.6);
  EXPECT_LT(world["heading_deg"]["rms"].get<double>(), 1.0);
}

TEST_F(ImportRecording, TheDresdenDrivesAreFollowedDespiteLateFixes) {
  const std::string data = data_path("gps_imu_balzer82");
  if (data.empty()) GTEST_SKIP() << kNoData;
  const std::map<std::string, int> drives = {{"2014-02-14-002-Data.csv", 300},
                                             {"2014-03-26-000-Data.csv", 2158}};
  for (const auto& [file, fixes] : drives) {
    const std::string import = fmt::format("import imu-gps {}/{} --columns {} -o {}/in.log --json",
                                           data, file, config("import/balzer82.toml"), folder_);
    ASSERT_EQ(rcs(import), 0) << messages();
    const json counts = json::parse(out());
    EXPECT_EQ(counts["GPS_FIX"]["written"], fixes);
    EXPECT_EQ(counts["GPS_FIX"]["missing"], fixes == 300 ? 1 : 0) << "altitude 0";
    EXPECT_EQ(counts["INS"]["gaps"], 0);
    ASSERT_EQ(replay("balzer82.toml"), 0) << messages();
    const Taken t = taken();
    EXPECT_EQ(t.last.world_valid, 1) << file;
    EXPECT_GT(t.fixes, fixes * 7 / 10) << file;
    EXPECT_GT(t.accepted, t.fixes * 9 / 10) << file;
  }
}

TEST_F(ImportRecording, TheHuskyReturnsToItsStart) {
  const std::string data = data_path("gps_imu_husky");
  if (data.empty()) GTEST_SKIP() << kNoData;
  ASSERT_EQ(rcs(husky_import(data + "/test1_imu.csv " + data + "/test1_fix.csv " + data +
                             "/test1_odom.csv ") +
                "--json"),
            0)
      << messages();
  const json counts = json::parse(out());
  EXPECT_EQ(counts["INS"]["written"], 11864);
  EXPECT_EQ(counts["GPS_FIX"]["written"], 989);
  EXPECT_EQ(counts["ODOMETRY"]["written"], 3952);
  ASSERT_EQ(replay("husky.toml"), 0) << messages();
  const Taken t = taken();
  EXPECT_EQ(t.last.world_valid, 1);
  EXPECT_GT(t.accepted, t.fixes * 8 / 10);
  // Its last fix is 13 m from its first, where the world begins.
  EXPECT_LT(std::hypot(t.last.p_world_vehicle_m[0] - 13.4, t.last.p_world_vehicle_m[1] + 1.4),
            10.0);
}

}  // namespace
}  // namespace rcs::test

// `rcs outages` on the command line, on a simulated drive of some seconds.

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class OutagesCommand : public RcsCommand {
 protected:
  OutagesCommand() {
    const std::string config = variable("RCS_SOURCE_DIR") + "/config/";
    options_ = "outages " + log_ + " --config " + config + "demo3.toml ";
    simulate_ = "sim " + config + "sim/drill.toml --duration 15 -o " + log_;
  }

  std::string log_ = folder_ + "/drive.log";
  std::string options_;
  std::string simulate_;
};

TEST_F(OutagesCommand, ReportsTheErrorsRepeatably) {
  ASSERT_EQ(rcs(simulate_), 0) << messages();
  const std::string question = "--length 2,3 --places 2 --from 9 --without odometry+ladar ";
  ASSERT_EQ(rcs(options_ + question + "--json"), 0) << messages();
  const json j = json::parse(out());
  EXPECT_EQ(j["reference"], "SIM_TRUTH of the log");
  EXPECT_EQ(j["groups"].size(), 4U);
  EXPECT_EQ(j["outages"].size(), 8U);
  EXPECT_EQ(j["groups"][1]["sources"], "all sources");
  EXPECT_EQ(j["groups"][3]["sources"], "without odometry and ladar");
  EXPECT_EQ(j["groups"][1]["evaluated"], 2);
  for (const char* who : {"WM", "WM with GPS", "gyro and wheels", "INS alone", "LADAR alone"}) {
    EXPECT_LT(j["groups"][1]["horizontal_m"][who]["worst"].get<double>(), 3.0) << who;
  }
  EXPECT_FALSE(j["groups"][3]["horizontal_m"].contains("LADAR alone"));
  ASSERT_EQ(rcs(options_ + question + "--json --jobs 1"), 0) << messages();
  EXPECT_EQ(json::parse(out()), j);

  ASSERT_EQ(rcs(options_ + "--from 8 --cut 9,12 --logs " + folder_ + "/runs"), 0) << messages();
  EXPECT_THAT(out(), HasSubstr("reference of the errors: SIM_TRUTH of the log"));
  EXPECT_THAT(out(), HasSubstr("start to end"));
  const std::string why = "why " + folder_ + "/runs/gps_cut_3s_at_9.0s.log 11";
  EXPECT_EQ(rcs(why), 0) << messages();

  for (const std::string& log : {log_, folder_ + "/runs/gps_cut_3s_at_9.0s.log"}) {
    std::fstream file(log, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(std::filesystem::file_size(log) / 4));
    file << std::string(2000, '\xff');
  }
  EXPECT_EQ(rcs(options_ + "--from 8 --cut 9,12"), 0) << "what is readable is evaluated";
  EXPECT_THAT(messages(), HasSubstr("drive.log: "));
  EXPECT_THAT(messages(), HasSubstr("unreadable bytes"));
  EXPECT_EQ(rcs(why), 0);
  EXPECT_THAT(messages(), HasSubstr("unreadable bytes"));
}

TEST_F(OutagesCommand, ErrorsAreReported) {
  EXPECT_EQ(rcs("outages --help"), 0);
  EXPECT_THAT(out(), HasSubstr("--without"));
  EXPECT_EQ(rcs("outages"), 2);
  EXPECT_EQ(rcs("outages nothing.log --config x.toml"), 3);
  std::ofstream(log_) << "";
  EXPECT_EQ(rcs(options_ + "--cut 20,10"), 2);
  EXPECT_EQ(rcs(options_ + "--cut 10,20 --length 5"), 2);
  EXPECT_EQ(rcs(options_ + "--without gps"), 2);
  EXPECT_THAT(messages(), HasSubstr("odometry, ladar, ins"));
  EXPECT_EQ(rcs(options_), 3);
  EXPECT_THAT(messages(), HasSubstr("no valid GPS_FIX"));
  ASSERT_EQ(rcs(simulate_), 0) << messages();
  EXPECT_EQ(rcs(options_), 3);
  EXPECT_THAT(messages(), HasSubstr("does not fit"));
}

}  // namespace
}  // namespace rcs::test

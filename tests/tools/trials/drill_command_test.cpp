// `rcs drill` and `rcs why` on the command line, on a drive of some seconds.

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "rcs/node/log/log_file.h"
#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class DrillCommand : public RcsCommand {
 protected:
  DrillCommand() {
    std::ofstream(drill_) << R"(
name = "GPS lost"
[run]
length_s = 14
[[stimulus]]
kind = "dropout"
source = "gps"
begin_s = 9
length_s = 3
[limits]
smooth_step_m = 0.2
horizontal_m = 5
)";
  }
  [[nodiscard]] static std::string config(const std::string& path) {
    return variable("RCS_SOURCE_DIR") + "/config/" + path;
  }
  int drill(const std::string& options) {
    return rcs("drill --scenario " + config("sim/drill.toml") + " --config " +
               config("demo3.toml") + " " + options);
  }
  [[nodiscard]] std::string file(const std::string& name) const {
    return text_of(folder_ + "/results/" + name);
  }

  std::string drill_ = folder_ + "/lost.toml";
};

TEST_F(DrillCommand, ReportsMetricsAndDrawsRepeatably) {
  EXPECT_EQ(drill(drill_ + " --seeds 2 --logs --json -o " + folder_ + "/results"), 0) << messages();
  const json j = json::parse(out());
  const json& first = j["drills"][0];
  EXPECT_EQ(first["verdict"], "pass");
  ASSERT_EQ(first["runs"].size(), 2U);
  EXPECT_EQ(first["runs"][1]["seed"], 2);
  EXPECT_NEAR(first["runs"][0]["simulated_s"].get<double>(), 14.0, 0.1);
  EXPECT_EQ(first["runs"][0]["outages"].size(), 1U);
  EXPECT_GT(first["runs"][0]["outages"][0]["driven_m"].get<double>(), 15.0);
  EXPECT_NE(first["runs"][0]["hash"], first["runs"][1]["hash"]);
  EXPECT_EQ(json::parse(file("results.json")), j);
  EXPECT_THAT(file("junit.xml"), HasSubstr("failures=\"0\""));
  const std::string page = file("report.html");
  EXPECT_THAT(page, HasSubstr("GPS lost: pass"));
  EXPECT_THAT(page, HasSubstr("</svg>"));
  EXPECT_THAT(page, Not(HasSubstr("nan")));

  EXPECT_EQ(drill(drill_ + " --json"), 0) << messages();
  EXPECT_EQ(json::parse(out())["drills"][0]["runs"][0], first["runs"][0]);

  EXPECT_EQ(rcs("why " + folder_ + "/results/lost.log 11"), 0) << messages();
  for (const char* word : {"GPS_FIX", "SP_REGISTRATION", "rolling map", "belief of WM", "sigma"}) {
    EXPECT_THAT(out(), HasSubstr(word));
  }
  EXPECT_EQ(rcs("why " + folder_ + "/results/lost.log 500"), 3);
  EXPECT_THAT(messages(), HasSubstr("the log ends after"));
}

TEST_F(DrillCommand, AMissedLimitExitsWithOne) {
  std::ofstream(drill_, std::ios::app) << "accept_within_s = 0.001\ndrift_pct_p95 = 0\n";
  EXPECT_EQ(drill(drill_), 1);
  EXPECT_THAT(out(), HasSubstr("FAIL"));
}

TEST_F(DrillCommand, ALogWithoutGroundTruthIsComparedWithItsUndisturbedRun) {
  const std::string log = folder_ + "/drive.log";
  ASSERT_EQ(rcs("sim " + config("sim/drill.toml") + " --duration 14 -o " + log), 0) << messages();
  const std::string options =
      " --config " + config("demo3.toml") + " --log " + log + " --json " + drill_;
  EXPECT_EQ(rcs("drill" + options), 0) << messages();
  EXPECT_GT(json::parse(out())["drills"][0]["runs"][0]["samples"].get<int>(), 20);
  EXPECT_EQ(rcs("drill " + config("drills/map/d11_map_turned.toml") + options), 0) << messages();
  EXPECT_EQ(json::parse(out())["drills"][0]["verdict"], "not run");
  EXPECT_EQ(rcs("drill --config " + config("demo3.toml") + " --log " + log + " " +
                config("drills/map/d11_map_turned.toml")),
            3);
  EXPECT_THAT(messages(), HasSubstr("no drill could run"));
}

TEST_F(DrillCommand, ALiveLogHasItsOwnClock) {
  const std::string log = folder_ + "/drive.log";
  const std::string live = folder_ + "/live.log";
  ASSERT_EQ(rcs("sim " + config("sim/drill.toml") + " --duration 14 -o " + log), 0) << messages();
  Result<LogReader> reader = LogReader::open(log);
  Result<LogWriter> writer = LogWriter::create(live);
  ASSERT_TRUE(reader.ok() && writer.ok());
  LogEvent event;
  while (reader->next(&event)) {
    const Stamp unix_time = event.stamp + std::chrono::hours(24 * 365 * 50);
    ASSERT_TRUE(writer->write(unix_time, event.channel, event.data.data(), event.data.size()));
  }
  ASSERT_TRUE(writer->close());
  json results[2];
  for (int k = 0; k < 2; ++k) {
    EXPECT_EQ(rcs("drill --config " + config("demo3.toml") + " --log " + (k == 0 ? log : live) +
                  " --json " + drill_),
              0)
        << messages();
    results[k] = json::parse(out())["drills"][0]["runs"][0];
    results[k].erase("hash");  // hash of the outputs, which contain node time
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST_F(DrillCommand, AWrongCommandLineExitsWithTwoAndAWrongFileIsNamed) {
  EXPECT_EQ(rcs("drill"), 2);
  EXPECT_EQ(rcs("drill nothing.toml"), 3);
  EXPECT_EQ(drill(drill_ + " --seeds 0"), 2);
  EXPECT_EQ(rcs("drill --log " + drill_ + " --scenario " + drill_), 2);
  std::ofstream(drill_) << "[[stimulus]]\nkind = \"ramp\"\nrate_mps = 1000\n";
  EXPECT_EQ(drill(drill_), 3);
  EXPECT_THAT(messages(), testing::AllOf(HasSubstr("lost.toml:3"), HasSubstr("rate_mps")));
  EXPECT_EQ(rcs("drill --list --folder " + config("drills")), 0);
  EXPECT_THAT(out(), HasSubstr("d14_return"));
  EXPECT_EQ(rcs("why"), 2);
}

}  // namespace
}  // namespace rcs::test

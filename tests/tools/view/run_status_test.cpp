// The state as text for Prometheus.

#include <gmock/gmock.h>

#include <limits>
#include <regex>
#include <set>
#include <sstream>

#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "tools/view/run_status.h"

namespace rcs::view {
namespace {

using testing::HasSubstr;
using testing::Not;

class Status : public testing::Test {
 protected:
  template <class T>
  void add(const char* channel, const T& message, double at_s) {
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
    (void)message.encode(bytes.data(), 0, message.getEncodedSize());
    status_.add({channel, bytes.data(), bytes.size(), from_seconds(at_s), 0});
  }
  std::string metrics(double now_s) { return metrics_text(status_.view(from_seconds(now_s)), {}); }

  RunStatus status_;
};

TEST_F(Status, CycleTimesHaveQuantilesOfTheLastSeconds) {
  for (int i = 0; i < 100; ++i) {
    cycle_t cycle{};
    cycle.node = "sp";
    cycle.used_wall_us = i == 50 ? 90'000 : 1000 * (1 + i % 10);
    cycle.overruns = 3;
    add("SP_CYCLE", cycle, 0.04 * i);
  }
  const std::string text = metrics(4.0);
  EXPECT_THAT(text, HasSubstr("rcs_node_cycle_seconds{node=\"sp\",quantile=\"0.5\"} 0.006\n"));
  EXPECT_THAT(text, HasSubstr("rcs_node_cycle_seconds{node=\"sp\",quantile=\"0.99\"} 0.01\n"));
  EXPECT_THAT(text, HasSubstr("rcs_node_cycle_seconds{node=\"sp\",quantile=\"1\"} 0.09\n"));
  EXPECT_THAT(text, HasSubstr("rcs_node_overruns_total{node=\"sp\"} 3\n"));
}

TEST_F(Status, TheMissionIsNotBg) {
  status_t bg{};
  bg.state = "DRIVING_NO_GPS";
  status_t mission{};
  mission.state = "RETURNING";
  add("BG_STATUS", bg, 0.0);
  add("MISSION_STATUS", mission, 0.1);
  const std::string text = metrics(0.2);
  EXPECT_THAT(text, HasSubstr("rcs_bg_state{state=\"DRIVING_NO_GPS\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("rcs_mission_state{state=\"RETURNING\"} 1\n"));
  const auto json = to_json(status_.view(from_seconds(0.2)));
  EXPECT_EQ(json["bg"]["state"], "DRIVING_NO_GPS");
  EXPECT_EQ(json["mission"]["state"], "RETURNING");
}

TEST_F(Status, AnInfiniteProtectionLevelIsInf) {
  integrity_t integrity{};
  integrity.validity = integrity_t::VALID_LOCAL;
  integrity.protection_horizontal_m = std::numeric_limits<double>::infinity();
  integrity.limit_horizontal_m = 5.0;
  add("WM_INTEGRITY", integrity, 0.0);
  EXPECT_THAT(metrics(0.1), HasSubstr("rcs_protection_level_meters{axis=\"horizontal\"} +Inf\n"));
  integrity.validity = integrity_t::VALID_WORLD;
  integrity.protection_horizontal_m = 1.25;
  integrity.protection_vertical_m = 2.5;
  add("WM_INTEGRITY", integrity, 0.2);
  EXPECT_THAT(metrics(0.3), HasSubstr("rcs_protection_level_meters{axis=\"horizontal\"} 1.25\n"));
}

TEST_F(Status, OneModeIsCurrent) {
  nav_state_t nav{};
  nav.mode = nav_state_t::MODE_INS_LADAR;
  nav.pose_valid = 1;
  add("WM_NAV_STATE", nav, 0.0);
  const std::string text = metrics(0.0);
  EXPECT_THAT(text, HasSubstr("rcs_navigation_mode{mode=\"INS_LADAR\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("rcs_navigation_mode{mode=\"LOST\"} 0\n"));
}

TEST_F(Status, TheTextIsOfTheFormatOfPrometheus) {
  process_t process{};
  process.node = "a\"b\\c\nd";  // a name that would end a label
  process.rss_kb = 1000;
  add("SP_PROCESS", process, 0.0);
  cycle_t cycle{};
  cycle.node = "wm";
  add("WM_CYCLE", cycle, 0.0);
  nav_state_t nav{};
  add("WM_NAV_STATE", nav, 0.0);
  integrity_t integrity{};
  add("WM_INTEGRITY", integrity, 0.0);
  const std::regex comment(R"(# (HELP|TYPE) [a-z_]+ .+)");
  const std::regex sample(
      R"re(([a-z_0-9]+)(\{[a-z]+="([^"\\]|\\["\\n])*"(,[a-z]+="([^"\\]|\\["\\n])*")*\})? (\+Inf|-Inf|NaN|[-+.0-9e]+))re");
  std::istringstream lines(metrics(0.1));
  std::set<std::string> described;
  std::set<std::string> samples;
  int n = 0;
  for (std::string line; std::getline(lines, line); ++n) {
    std::smatch match;
    if (line[0] == '#') {
      EXPECT_TRUE(std::regex_match(line, comment)) << line;
      std::istringstream words(line);
      std::string hash, kind, name;
      words >> hash >> kind >> name;
      if (kind == "TYPE") {
        EXPECT_TRUE(described.insert(name).second) << name << " twice";
      }
      continue;
    }
    ASSERT_TRUE(std::regex_match(line, match, sample)) << line;
    EXPECT_EQ(described.count(match[1]), 1U) << line;
    EXPECT_TRUE(samples.insert(line.substr(0, line.rfind(' '))).second) << line << " twice";
  }
  EXPECT_GT(n, 40);
}

TEST_F(Status, ClearForgets) {
  nav_state_t nav{};
  add("WM_NAV_STATE", nav, 0.0);
  status_.clear();
  EXPECT_THAT(metrics(0.0), Not(HasSubstr("rcs_navigation_mode{")));
  EXPECT_TRUE(to_json(status_.view(Duration{}))["nodes"].empty());
}

}  // namespace
}  // namespace rcs::view

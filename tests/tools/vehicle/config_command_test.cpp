// `rcs config` on the command line, and its table of parameters.

#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;

class ConfigCommand : public RcsCommand {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ + "/" + name) << text;
    return folder_ + "/" + name;
  }
  [[nodiscard]] static std::string shipped(const std::string& name) {
    return variable("RCS_SOURCE_DIR") + "/config/" + name;
  }
  /// Lines of the last command's output.
  [[nodiscard]] std::vector<std::string> lines() const {
    std::istringstream text(out());
    std::vector<std::string> all;
    for (std::string line; std::getline(text, line);) all.push_back(line);
    return all;
  }
};

/// The keys in the source of a parser: get("key", ...), and the two of get_pose("prefix", ...).
std::set<std::string> keys_read_by(const std::string& source) {
  const std::string text = text_of(variable("RCS_SOURCE_DIR") + "/" + source);
  const std::regex call("(?:\\.|->)get(_ms|_deg|_pose|_scaled)?\\(\\s*\"(\\w+)\"");
  std::set<std::string> keys;
  for (std::sregex_iterator m(text.begin(), text.end(), call), end; m != end; ++m) {
    if ((*m)[1] == "_pose") {
      keys.insert((*m)[2].str() + "_m");
      keys.insert((*m)[2].str() + "_rpy_deg");
    } else {
      keys.insert((*m)[2]);
    }
  }
  return keys;
}

TEST_F(ConfigCommand, ListHasEveryKeyThatAParserReads) {
  ASSERT_EQ(rcs("config list"), 0) << messages();
  std::set<std::string> listed;
  std::set<std::string> full;
  for (const std::string& line : lines()) {
    const std::string key = line.substr(0, line.find(' '));
    EXPECT_TRUE(full.insert(key).second) << key << " twice";
    listed.insert(key.substr(key.rfind('.') + 1));
  }
  std::set<std::string> read;
  for (const char* source :
       {"modules/sp/sp_config.cpp", "modules/wm/wm_config.cpp", "modules/bg/bg_config.cpp",
        "modules/mission/mission_config.cpp", "modules/gateway/gateway_config.cpp",
        "modules/ros2_bridge/ros2_bridge_config.cpp", "rcs/dds/network.cpp",
        "rcs/node/params/ladar_mount.h", "rcs/node/process/process.cpp",
        "rcs/prior/prior_terrain.cpp", "rcs/zones/zone_params.cpp"}) {
    const std::set<std::string> keys = keys_read_by(source);
    EXPECT_FALSE(keys.empty()) << source;
    read.insert(keys.begin(), keys.end());
  }
  for (const std::string& key : read) EXPECT_TRUE(listed.count(key)) << key << " is not listed";
  for (const std::string& key : full) {
    if (key.compare(0, 7, "budget.") == 0) continue;  // composed of a prefix and a suffix
    EXPECT_TRUE(read.count(key.substr(key.rfind('.') + 1))) << key << " is not read by any parser";
  }
}

TEST_F(ConfigCommand, EveryKeyHasADescription) {
  ASSERT_EQ(rcs("config list --json"), 0) << messages();
  const nlohmann::json all = nlohmann::json::parse(out())["parameters"];
  ASSERT_GT(all.size(), 300U);
  for (const nlohmann::json& p : all) {
    const std::string meaning = p["meaning"];
    EXPECT_GT(meaning.size(), 15U) << p["key"];
    EXPECT_TRUE(meaning.empty() || meaning.back() == '.') << p["key"] << ": " << meaning;
    EXPECT_TRUE(p["type"] == "text" || p["type"] == "true or false" ||
                p["type"] == "list of texts" || p.contains("range"))
        << p["key"];
  }
}

TEST_F(ConfigCommand, ExplainPrintsTypeUnitRangeAndDefault) {
  ASSERT_EQ(rcs("config explain wm.history.bridge_ms"), 0) << messages();
  EXPECT_THAT(out(), AllOf(HasSubstr("wm.history.bridge_ms\n"), HasSubstr("number (ms)"),
                           HasSubstr("range    [1, 1000]"), HasSubstr("default  50")));
  ASSERT_EQ(rcs("config explain bridge_ms"), 0) << "by the key only";
  EXPECT_THAT(out(), HasSubstr("wm.history.bridge_ms\n"));
  ASSERT_EQ(rcs("config explain wm.history"), 0) << "a whole table";
  EXPECT_THAT(out(), AllOf(HasSubstr("lag_ms"), HasSubstr("jump_ms")));
  EXPECT_EQ(rcs("config explain wm.history.brigde_ms"), 2);
  EXPECT_THAT(messages(), HasSubstr("did you mean wm.history.bridge_ms?"));
}

TEST_F(ConfigCommand, CheckReportsAllErrorsInTheOrderOfTheFile) {
  const std::string file = write("bad.toml",
                                 "[sp.icp]\n"
                                 "gate_m = 1000\n"
                                 "[wm]\n"
                                 "false_alarms = 0.001\n"
                                 "[bg]\n"
                                 "period_ms = \"fast\"\n");
  EXPECT_EQ(rcs("config check " + file), 1);
  const std::vector<std::string> found = lines();
  ASSERT_EQ(found.size(), 3U) << out();
  EXPECT_THAT(found[0], AllOf(HasSubstr(file + ":2: [sp.icp] gate_m"), HasSubstr("(m)")));
  EXPECT_THAT(found[1], AllOf(HasSubstr(":4: [wm] unknown key false_alarms"),
                              HasSubstr("did you mean false_alarm?")));
  EXPECT_THAT(found[2], HasSubstr(":6: [bg] period_ms = 'fast': not a number"));
}

// Once, though several programs know the key.
TEST_F(ConfigCommand, CheckReportsErrorsOfTheFileOfZones) {
  write("zones.geojson", R"({"type":"FeatureCollection","features":[{"type":"Feature",)"
                         R"("properties":{"kind":"lake","name":"pond"},"geometry":null}]})");
  const std::string file = write("a.toml", "[world]\nzones = \"zones.geojson\"\n");
  EXPECT_EQ(rcs("config check " + file), 1);
  const std::vector<std::string> found = lines();
  ASSERT_EQ(found.size(), 1U) << out();
  EXPECT_THAT(found[0], AllOf(HasSubstr(file + ":2: [world] zones"),
                              HasSubstr("zones.geojson: feature 1 \"pond\": kind: is \"lake\"")));
  EXPECT_EQ(rcs("config check " + write("b.toml", "[world]\nzones = \"none.geojson\"\n")), 1);
  EXPECT_THAT(out(), HasSubstr("none.geojson: cannot open"));
}

TEST_F(ConfigCommand, CheckRejectsInvalidToml) {
  EXPECT_EQ(rcs("config check " + write("bad.toml", "[sp\n")), 1);
  EXPECT_THAT(out(), HasSubstr("bad.toml:"));
  EXPECT_EQ(rcs("config check " + folder_ + "/absent.toml"), 3);
  EXPECT_EQ(rcs("config check"), 2);
}

TEST_F(ConfigCommand, TheShippedConfigurationsHaveNoErrors) {
  std::string files;
  for (const auto& entry : std::filesystem::directory_iterator(shipped(""))) {
    if (entry.path().extension() == ".toml") files += " " + entry.path().string();
  }
  EXPECT_EQ(rcs("config check" + files), 0) << out() << messages();
}

TEST_F(ConfigCommand, ShowPrintsTheSameConfiguration) {
  ASSERT_EQ(rcs("config show " + shipped("demo3.toml") + " --set sp.icp.gate_m=7.5"), 0)
      << messages();
  const std::string shown = out();
  EXPECT_THAT(shown,
              AllOf(HasSubstr("gate_m = 7.5"), HasSubstr("# default"), HasSubstr("demo3.toml:")));
  ASSERT_EQ(rcs("config show " + write("again.toml", shown)), 0) << messages();
  // The same values; all of them now come from the file.
  const auto values = [](const std::string& text) {
    return std::regex_replace(text, std::regex(" *#[^\n]*"), "");
  };
  EXPECT_EQ(values(out()), values(shown));
  ASSERT_EQ(rcs("config show --changed " + shipped("demo3.toml")), 0);
  EXPECT_THAT(out(), Not(HasSubstr("# default")));
}

TEST_F(ConfigCommand, AnUnknownTableIsReportedOnce) {
  EXPECT_EQ(rcs("config check " + write("bad.toml", "[gatway]\nx = 1\n[a]\n")), 1);
  const std::vector<std::string> found = lines();
  ASSERT_EQ(found.size(), 2U) << out();
  EXPECT_THAT(found[0], HasSubstr("unknown table gatway; did you mean gateway?"));
  EXPECT_THAT(found[1], EndsWith("unknown table a"));
}

}  // namespace
}  // namespace rcs::test

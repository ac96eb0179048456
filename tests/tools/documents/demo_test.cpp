// The baselines of tools/demo: each fuses the sensors of its name, on a simulated drive of some
// seconds with the options of the demo.

#include <gmock/gmock.h>

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <vector>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using nlohmann::json;

using Sources = std::vector<std::string>;

/// Baselines by their names in tools/demo.
const std::map<std::string, Sources>& expected() {
  static const std::map<std::string, Sources> kExpected = {
      {"all sensors", {"LADAR", "wheel encoders", "INS", "motion constraints"}},
      {"without LADAR", {"wheel encoders", "INS", "motion constraints"}},
      {"LADAR, INS and constraint", {"LADAR", "INS", "motion constraints"}},
      {"INS and constraint", {"INS", "motion constraints"}},
      {"LADAR and INS", {"LADAR", "INS"}},
      {"INS alone", {"INS"}}};
  return kExpected;
}

class Demo : public RcsCommand {
 protected:
  /// Output of a function of the script.
  std::string function(const std::string& name) {
    const std::string source = variable("RCS_SOURCE_DIR");
    const std::string command = "cd " + source +
                                " && bash -c 'set -euo pipefail; source <(sed -n \"/^" + name +
                                "() {/,/^}/p\" tools/demo); " + name + "' >" + folder_ + "/written";
    EXPECT_EQ(std::system(command.c_str()), 0) << name;  // NOLINT(cert-env33-c)
    return text_of(folder_ + "/written");
  }

  std::vector<std::string> names_;
  std::string runs_;
};

TEST_F(Demo, EachBaselineFusesTheSensorsOfItsName) {
  const std::string vehicle = variable("RCS_SOURCE_DIR") + "/config/demo3.toml";
  const std::string log = folder_ + "/drive.log";
  // GPS is denied from 12 s to 26 s; during this time the vehicle arrives and stops.
  const std::string scenario = folder_ + "/scenario.toml";
  std::ofstream(scenario) << "based_on = \"" << variable("RCS_SOURCE_DIR")
                          << "/config/sim/drill.toml\"\n"
                             "[course]\nspeed_kmph = 20.0\nwaypoint = [{ x_m = 0, y_m = 0 },"
                             " { x_m = 40, y_m = 0 }, { x_m = 75, y_m = 20 }]\n";
  ASSERT_EQ(rcs("sim " + scenario + " --duration 32 --gps-outage 12,14 -o " + log), 0)
      << messages();

  const auto replay = [&](const std::string& name, const std::string& options) {
    const std::string out = folder_ + "/" + std::to_string(names_.size()) + ".log";
    EXPECT_EQ(rcs("replay " + vehicle + " " + log + " -o " + out + " " + options), 0) << messages();
    runs_ += " \"" + name + "=" + out + "\"";
    names_.push_back(name);
  };
  replay("all sensors", "");
  std::istringstream baselines(function("baselines"));
  for (std::string line; std::getline(baselines, line);) {
    const std::size_t bar = line.find('|');
    ASSERT_NE(bar, std::string::npos) << line;
    replay(line.substr(0, bar), line.substr(bar + 1));
  }
  ASSERT_EQ(names_.size(), expected().size());

  ASSERT_EQ(rcs("report" + runs_ + " --json -o " + folder_ + "/report.html"), 0) << messages();
  const json j = json::parse(out());
  for (const json& run : j["runs"]) {
    const std::string name = run["name"];
    ASSERT_EQ(expected().count(name), 1U) << name;
    ASSERT_EQ(run["outages"].size(), 1U) << name;
    EXPECT_EQ(run["outages"][0]["fused"].get<Sources>(), expected().at(name)) << name;
  }
  EXPECT_NE(text_of(folder_ + "/report.html").find("INS alone: INS<"), std::string::npos);

  // A limit that the runs exceed is an error, one that they keep is not.
  EXPECT_EQ(rcs("report" + runs_ + " --min-factor 1e6 -o " + folder_ + "/report.html"), 1);
  EXPECT_THAT(messages(), testing::HasSubstr("--min-factor"));
  EXPECT_EQ(rcs("report" + runs_ + " --min-factor 1e-6 -o " + folder_ + "/report.html"), 0);
}

}  // namespace
}  // namespace rcs::test

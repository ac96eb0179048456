// `rcs table1` on the command line, on simulated scans.

#include <gmock/gmock.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class Table1Command : public RcsCommand {
 protected:
  Table1Command() {
    if (const char* data = std::getenv("RCS_DATA_DIR"); data != nullptr) data_ = data;
    ::unsetenv("RCS_DATA_DIR");
  }
  ~Table1Command() override {
    if (!data_.empty()) ::setenv("RCS_DATA_DIR", data_.c_str(), 1);
  }
  std::string data_;
};

TEST_F(Table1Command, ComparesEveryMethodOnEverySetWithThePaper) {
  EXPECT_EQ(rcs("table1 --pairs 1 --seeds 1 --json"), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("without real scans"));
  const json table = json::parse(out())["sets"];
  ASSERT_EQ(table.size(), 4U);
  EXPECT_EQ(table[3]["paper"]["iterations"], 83);
  EXPECT_DOUBLE_EQ(table[3]["paper"]["mean_distance_after_cm"].get<double>(), 11.66);
  for (const json& set : table) {
    ASSERT_EQ(set["methods"].size(), 4U);
    EXPECT_EQ(set["methods"][0]["method"], "paper, as printed");
    EXPECT_EQ(set["methods"][2]["method"], "plane");
    for (const json& row : set["methods"]) {
      EXPECT_EQ(row["scans"], "simulation");
      EXPECT_EQ(row["trials"], 1);
      EXPECT_GT(row["model_points"].get<double>(), 3000.0);
      EXPECT_GT(row["mean_distance_before_cm"].get<double>(), 0.0);
      EXPECT_GE(row["error_m"].get<double>(), 0.0);
      EXPECT_LE(row["overlap"].get<double>(), 1.0);
    }
    // The initial guess is the same for all.
    EXPECT_EQ(set["methods"][0]["mean_distance_before_cm"],
              set["methods"][2]["mean_distance_before_cm"]);
  }
  EXPECT_EQ(rcs("table1 --pairs 1 --seeds 1"), 0) << messages();
  EXPECT_THAT(out(), HasSubstr("4852/4848"));
  EXPECT_THAT(out(), HasSubstr("\n simulation: 1\n  paper, as printed"));
  EXPECT_THAT(out(), HasSubstr("whose motion is known exactly"));
  EXPECT_THAT(out(), testing::Not(HasSubstr("KITTI")));
  std::istringstream lines(out());
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 100U) << line;
}

TEST_F(Table1Command, ShowsTheCutsOfKittiWhereTheDataAre) {
  if (data_.empty()) GTEST_SKIP() << "RCS_DATA_DIR is not set";
  const std::string pictures = folder_ + "/figures";
  EXPECT_EQ(rcs("table1 --pairs 1 --seeds 1 --data " + data_ + " --plot " + pictures), 0)
      << messages();
  EXPECT_THAT(text_of(pictures + "/kitti_figure_3c.svg"), HasSubstr("accepted pair"));
  EXPECT_THAT(text_of(pictures + "/index.html"), HasSubstr("KITTI, figure 2 (a)"));
  EXPECT_THAT(out(), HasSubstr("\n KITTI: "));
  EXPECT_THAT(out(), HasSubstr("KITTI: N trials on sweeps of drive 0005"));
  EXPECT_THAT(messages(), testing::Not(HasSubstr("without real scans")));
}

TEST_F(Table1Command, DrawsTheFiguresOfThePaper) {
  const std::string pictures = folder_ + "/new/figures";
  EXPECT_EQ(rcs("table1 --pairs 1 --seeds 1 --json --plot " + pictures), 0) << messages();
  EXPECT_EQ(json::parse(out())["sets"].size(), 4U);
  const std::string page = text_of(pictures + "/index.html");
  EXPECT_THAT(page, HasSubstr("rcs table1 --pairs 1 --seeds 1 --json --plot"));
  EXPECT_THAT(page, testing::Not(HasSubstr("KITTI")));
  for (const char* figure : {"2a", "2b", "2c", "2d", "3a", "3b", "3c", "3d"}) {
    const std::string name = std::string("simulation_figure_") + figure + ".svg";
    const std::string svg = text_of(pictures + "/" + name);
    EXPECT_THAT(svg, HasSubstr("</svg>")) << name;
    EXPECT_THAT(svg, testing::Not(HasSubstr("nan"))) << name;
    EXPECT_THAT(page, HasSubstr(name));
  }
  EXPECT_EQ(rcs("table1 --pairs 1 --seeds 1 --trial 2 --plot " + pictures), 2);
  EXPECT_THAT(messages(), HasSubstr("--trial 2: simulation has 1 trials of #1 and 1 of #3"));
  EXPECT_EQ(rcs("table1 --trial 2"), 2);
  EXPECT_THAT(messages(), HasSubstr("--plot"));
  EXPECT_EQ(rcs("table1 --pairs 1 --plot " + folder_ + "/out"), 3);  // a file
}

TEST_F(Table1Command, ReportsMissingData) {
  // The variable may be set for other data: the simulation is shown, and the reason.
  ::setenv("RCS_DATA_DIR", folder_.c_str(), 1);
  EXPECT_EQ(rcs("table1 --pairs 1 --seeds 1"), 0) << messages();
  EXPECT_THAT(messages(), HasSubstr("without real scans: RCS_DATA_DIR=" + folder_));
  EXPECT_THAT(messages(), HasSubstr("set RCS_DATA_DIR (or --data) to the folder that contains "
                                    "kitti_2011_09_26_drive_0005"));
  EXPECT_THAT(out(), HasSubstr("simulation"));
  ::unsetenv("RCS_DATA_DIR");
  EXPECT_EQ(rcs("table1 --data " + folder_), 3);
  EXPECT_THAT(messages(), HasSubstr("reference_pairs.csv"));
  EXPECT_EQ(rcs("table1 --data " + folder_ + "/nothing"), 3);
  EXPECT_EQ(rcs("table1 --seeds 17"), 2);
  EXPECT_EQ(rcs("table1 --scenario " + variable("RCS_SOURCE_DIR") + "/config/sim/spinning64.toml"),
            3);
  EXPECT_THAT(messages(), HasSubstr("range imager"));
}

}  // namespace
}  // namespace rcs::test

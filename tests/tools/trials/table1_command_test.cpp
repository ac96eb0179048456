// `rcs table1` on the command line, on simulated scans.

#include <gmock/gmock.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "tests/support/rcs_command.h"

namespace rcs::test {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class Table1Command : public RcsCommand {
 protected:
  Table1Command() { ::unsetenv("RCS_DATA_DIR"); }
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
    EXPECT_EQ(set["methods"][0]["method"], "paper, literal");
    EXPECT_EQ(set["methods"][2]["method"], "production");
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
  EXPECT_THAT(out(), HasSubstr("4852 / 4848"));
  EXPECT_THAT(out(), HasSubstr("simulation: paper, corrected"));
}

TEST_F(Table1Command, ReportsMissingData) {
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

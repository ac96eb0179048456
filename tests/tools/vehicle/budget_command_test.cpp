// `rcs budget` on the command line, on a private bus: sim, then the live nodes for a few seconds.

#include <nlohmann/json.hpp>

#include "tests/tools/vehicle/budget_fixture.h"

namespace rcs::test {
namespace {

TEST_F(BudgetCommand, AnExceededBudgetIsNamedWithValueAndLimitAndExitsWithOne) {
  prepare("4", "facet_to_nav_state_p50_ms = 0.001\n");
  const std::string svg = folder_ + "/budget.svg";
  EXPECT_EQ(rcs("budget " + vehicle() + " " + log() + " --json --svg " + svg), 1) << messages();
  EXPECT_NE(messages().find("limit exceeded: facet_to_nav_state_p50_ms is "), std::string::npos)
      << messages();
  EXPECT_NE(messages().find(", limit 0.001"), std::string::npos) << messages();
  const nlohmann::json metrics = nlohmann::json::parse(out());
  EXPECT_FALSE(metrics["met"].get<bool>());
  EXPECT_GT(metrics["scans"]["sent"].get<int>(), 30);
  EXPECT_NE(text_of(svg).find("</svg>"), std::string::npos);
}

TEST_F(BudgetCommand, AWrongCommandLineExitsWithTwoAndAWrongTableWithThree) {
  EXPECT_EQ(rcs("budget"), 2);
  EXPECT_EQ(rcs("budget nothing.toml nothing.log"), 3);
  prepare("1", "facet_to_nav_state_p98_ms = 1\n");
  EXPECT_EQ(rcs("budget " + vehicle() + " " + log()), 3);
  EXPECT_NE(messages().find("unknown key facet_to_nav_state_p98_ms"), std::string::npos)
      << messages();
}

}  // namespace
}  // namespace rcs::test

// The budgets of the live chain. The values depend on the computer, which must be quiet: label
// latency, not in the default set.

#include <cstdio>

#include "tests/tools/vehicle/budget_fixture.h"

namespace rcs::test {
namespace {

using BudgetLatency = BudgetCommand;

TEST_F(BudgetLatency, Demo3ScansAtTenHertzKeepTheirBudgets) {
  prepare("20",
          "facet_to_nav_state_p50_ms = 30\nfacet_to_nav_state_p99_ms = 80\ndropped_share = 0\n"
          "held_share = 0.01\nfailed_share = 0.01\noverrun_share = 0.01\n");
  EXPECT_EQ(rcs("budget " + vehicle() + " " + log()), 0) << messages() << out();
  std::printf("%s", out().c_str());
}

TEST_F(BudgetLatency, WithALoadedProcessorEveryScanIsAccountedFor) {
  prepare("10", "unaccounted_scans = 0\n");
  EXPECT_EQ(rcs("budget " + vehicle() + " " + log() + " --load cpu,io,memory --seconds 20"), 0)
      << messages() << out();
  std::printf("%s", out().c_str());
}

}  // namespace
}  // namespace rcs::test

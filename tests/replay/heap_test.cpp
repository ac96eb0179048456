// After warm-up the cycles of sp and wm do not allocate.

#include "tests/support/heap_guard.h"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <string>

#include "sim/scenario_file.h"
#include "tests/replay/chain.h"

namespace rcs::test {
namespace {

TEST(Chain, CyclesOfSpAndWmAllocateNothingAfterWarmUp) {
  if (!HeapGuard::available()) GTEST_SKIP() << "SKIPPED: a sanitizer owns malloc";
  sim::ScenarioOverrides overrides;
  overrides.duration_s = 40.0;
  const Result<sim::Scenario> scenario =
      load_scenario(source_path("config/sim/reference.toml"), overrides);
  ASSERT_TRUE(scenario.ok()) << scenario.error().message;

  struct Count {
    std::int64_t cycles = 0;
    std::int64_t after_warm_up = 0;
    std::int64_t allocations = 0;
    std::int64_t last_cycle = 0;  // that allocated
  };
  std::map<std::string, Count> counts = {{"sp", {}}, {"wm", {}}};
  std::optional<HeapGuard> guard;
  const auto around_cycle = [&](const Node& node, bool before) {
    if (before) {
      guard.emplace();
      return;
    }
    const std::int64_t allocations = guard->allocations();
    guard.reset();
    Count& count = counts.find(node.info().name)->second;
    // sp runs a cycle a facet (160 a second): its map and buffers have received a full scan many
    // times after 20 s; wm runs some 60 a second.
    const std::int64_t warm_up = node.info().name == "sp" ? 3200 : 1200;
    if (++count.cycles <= warm_up) return;
    ++count.after_warm_up;
    count.allocations += allocations;
    if (allocations > 0) count.last_cycle = count.cycles;
  };
  const ChainRun run = run_chain(*scenario, source_path("config/demo3.toml"), around_cycle);
  EXPECT_GT(run.scans, 350);
  EXPECT_GT(run.prior_matches, 300);
  for (const auto& [name, count] : counts) {
    EXPECT_GT(count.after_warm_up, 500) << name;
    EXPECT_EQ(count.allocations, 0) << name << ", last in cycle " << count.last_cycle;
  }
}

}  // namespace
}  // namespace rcs::test

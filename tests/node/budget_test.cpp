#include "rcs/node/budget.h"

#include <gtest/gtest.h>

#include <limits>

namespace rcs {
namespace {

Cycle cycle_with_slack(Duration slack) {
  Cycle cycle;
  cycle.now = from_utime(1'000'000);
  cycle.deadline = cycle.now + slack;
  return cycle;
}

TEST(Grant, IsTheSlackOverTheNominalCost) {
  // 10 ms, of which 30 % are kept in reserve, at 100 ns a unit.
  const GrantParams params{1'000'000, 100.0, 0.3};
  EXPECT_EQ(grant(cycle_with_slack(Duration(10'000)), params), 70'000);
}

TEST(Grant, IsCapped) {
  EXPECT_EQ(grant(cycle_with_slack(Duration(10'000)), {500, 100.0, 0.3}), 500);
  const Duration endless(std::numeric_limits<std::int64_t>::max() / 2);
  EXPECT_EQ(grant(cycle_with_slack(endless), {500, 1e-9, 0.0}), 500);
}

TEST(Grant, IsZeroAfterTheDeadline) {
  EXPECT_EQ(grant(cycle_with_slack(Duration(0)), GrantParams()), 0);
  EXPECT_EQ(grant(cycle_with_slack(Duration(-1)), GrantParams()), 0);
}

TEST(StageClock, StagesAddUpToTheCycle) {
  StageClock clock;
  clock.start_cycle();
  volatile double sink = 0.0;
  for (int i = 0; i < 100'000; ++i) sink = sink + 1.0;
  clock.mark("a");
  clock.mark("b");
  for (int i = 0; i < 100'000; ++i) sink = sink + 1.0;
  clock.mark("a");
  clock.end_cycle();
  ASSERT_EQ(clock.stages(), 2U);
  EXPECT_EQ(clock.stage(0).name, "a");
  EXPECT_GT(clock.stage(0).wall.count(), 0);
  EXPECT_LE(clock.stage(0).wall + clock.stage(1).wall, clock.used_wall());
}

TEST(StageClock, AnAccountSpansCyclesUntilItIsClosed) {
  StageClock clock;
  for (int i = 0; i < 3; ++i) {
    clock.start_cycle();
    clock.mark("convert");
    clock.end_cycle();
  }
  EXPECT_FALSE(clock.closed());
  const Duration before = clock.used_wall();
  clock.start_cycle();
  clock.mark("register");
  clock.close_account();
  clock.end_cycle();
  EXPECT_TRUE(clock.closed());
  EXPECT_EQ(clock.stages(), 2U);
  EXPECT_GE(clock.used_wall(), before);

  clock.start_cycle();
  EXPECT_FALSE(clock.closed());
  EXPECT_EQ(clock.stages(), 0U);
  EXPECT_EQ(clock.used_wall().count(), 0);
}

}  // namespace
}  // namespace rcs

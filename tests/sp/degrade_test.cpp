// The degrade level: up before a deadline is missed, down under low load, and by the timeline
// alone.
#include "modules/sp/degrade.h"

#include <gtest/gtest.h>

#include <vector>

namespace rcs::sp {
namespace {

constexpr Duration kBudget = from_milliseconds(80.0);

ScanFacts calm_facts() {
  ScanFacts f;
  f.budget = kBudget;
  f.left = kBudget;
  f.grant_share = 5.0;
  return f;
}

Degrade level_after(const DegradeLadder& ladder, const ScanFacts& facts) {
  return step(ladder, facts, {}).level;
}

TEST(DegradeLadder, WithEnoughTimeNothingIsOmitted) {
  DegradeLadder ladder;
  for (int i = 0; i < 100; ++i) {
    ladder = step(ladder, calm_facts(), {});
    EXPECT_EQ(ladder.level, Degrade::kFull);
  }
}

TEST(DegradeLadder, ASmallerGrantGivesAHigherLevel) {
  Degrade before = Degrade::kFull;
  for (const double share : {5.0, 1.0, 0.9, 0.7, 0.5, 0.3, 0.1, 0.0}) {
    ScanFacts f = calm_facts();
    f.grant_share = share;
    const Degrade level = level_after({}, f);
    EXPECT_GE(level, before) << share;
    before = level;
  }
  EXPECT_EQ(before, Degrade::kHold);
}

TEST(DegradeLadder, TheCauseIsTheLimitThatAScanExceeds) {
  EXPECT_EQ(cause_of(calm_facts(), {}), DegradeCause::kNone);
  ScanFacts f = calm_facts();
  f.grant_share = 0.9;
  EXPECT_EQ(cause_of(f, {}), DegradeCause::kGrant);
  f.late = kBudget;
  EXPECT_EQ(cause_of(f, {}), DegradeCause::kLate);
  f.behind = 1.0;
  EXPECT_EQ(cause_of(f, {}), DegradeCause::kBehind);
  f.left = Duration::zero();
  EXPECT_EQ(cause_of(f, {}), DegradeCause::kLeft);
}

TEST(DegradeLadder, LateCyclesDegradeStepByStepAndNeverHold) {
  ScanFacts f = calm_facts();
  f.late = from_milliseconds(70.0);
  DegradeLadder ladder;
  std::vector<Degrade> levels;
  for (int i = 0; i < 4; ++i) {
    ladder = step(ladder, f, {});
    levels.push_back(ladder.level);
  }
  EXPECT_EQ(levels, (std::vector<Degrade>{Degrade::kFewerPoints, Degrade::kNoPrior,
                                          Degrade::kNoPrior, Degrade::kNoPrior}));
  f.late = kBudget;
  EXPECT_EQ(level_after({}, f), Degrade::kNoPrior) << "a whole budget late: two steps at once";
}

TEST(DegradeLadder, AScanWithoutTimeOrWithASuccessorWaitingIsHeldAndTheNextIsProcessed) {
  ScanFacts late = calm_facts();
  late.left = from_milliseconds(10.0);
  ScanFacts overtaken = calm_facts();
  overtaken.behind = 0.6;
  for (const ScanFacts& f : {late, overtaken}) {
    const DegradeLadder held = step({}, f, {});
    EXPECT_EQ(held.level, Degrade::kHold);
    EXPECT_EQ(level_after(held, calm_facts()), Degrade::kNoPrior);
    EXPECT_EQ(level_after(held, f), Degrade::kHold) << "the next scan is just as late";
  }
}

TEST(DegradeLadder, AGrantThatIsAlwaysTooSmallHoldsEverySecondScanOnly) {
  ScanFacts f = calm_facts();
  f.grant_share = 0.01;
  DegradeLadder ladder;
  int held = 0;
  for (int i = 0; i < 100; ++i) {
    ladder = step(ladder, f, {});
    held += ladder.level == Degrade::kHold ? 1 : 0;
  }
  EXPECT_EQ(held, 50);
}

TEST(DegradeLadder, RecoversLevelByLevelAfterConsecutiveCalmScans) {
  const DegradeParams params;
  DegradeLadder ladder{Degrade::kNoPrior, 0};
  for (int i = 1; i < params.recover_after; ++i) {
    ladder = step(ladder, calm_facts(), params);
    EXPECT_EQ(ladder.level, Degrade::kNoPrior) << i;
  }
  // One scan that is not calm restarts the count, although it requires no higher level.
  ScanFacts tight = calm_facts();
  tight.late = from_milliseconds(50.0);
  ladder = step(ladder, tight, params);
  EXPECT_EQ(ladder.level, Degrade::kNoPrior);
  int scans = 0;
  while (ladder.level != Degrade::kFull && scans < 1000) {
    const Degrade before = ladder.level;
    ladder = step(ladder, calm_facts(), params);
    EXPECT_GE(static_cast<int>(ladder.level), static_cast<int>(before) - 1);
    ++scans;
  }
  EXPECT_EQ(scans, 2 * params.recover_after);
}

TEST(DegradeLadder, ConditionsBetweenTheThresholdsKeepTheLevel) {
  // Degraded work is faster: a load that is just low enough to keep the level must not lower it.
  const DegradeParams params;
  ScanFacts f = calm_facts();
  f.grant_share = 1.2;
  DegradeLadder ladder{Degrade::kFewerPoints, 0};
  for (int i = 0; i < 10 * params.recover_after; ++i) ladder = step(ladder, f, params);
  EXPECT_EQ(ladder.level, Degrade::kFewerPoints);
  EXPECT_EQ(level_after({}, f), Degrade::kFull);
}

TEST(DegradeLadder, SwitchedOffItOmitsNothing) {
  DegradeParams params;
  params.on = false;
  ScanFacts f = calm_facts();
  f.left = Duration(-1);
  EXPECT_EQ(step({Degrade::kNoPrior, 3}, f, params).level, Degrade::kFull);
}

}  // namespace
}  // namespace rcs::sp

#include "modules/wm/fault_detection/source_monitor.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <set>

namespace rcs::wm {
namespace {

constexpr std::array kStates = {SourceState::kUsed, SourceState::kSuspect, SourceState::kExcluded,
                                SourceState::kReadmitting, SourceState::kProbation};

bool is_fused(SourceState state) {
  return state != SourceState::kExcluded && state != SourceState::kReadmitting;
}

SourceFacts facts_of(unsigned bits) {
  return {(bits & 1U) != 0, (bits & 2U) != 0, (bits & 4U) != 0, (bits & 8U) != 0,
          (bits & 16U) != 0};
}

TEST(SourceMonitor, AMillionRandomFactsKeepTheLawsOfTheTable) {
  std::mt19937 random(7);
  SourceState state = SourceState::kUsed;
  std::set<std::pair<SourceState, SourceState>> seen;
  for (int k = 0; k < 1'000'000; ++k) {
    const SourceFacts facts = facts_of(static_cast<unsigned>(random()) % 32U);
    const SourceState next = next_state(state, facts);
    ASSERT_EQ(is_fused(next), !facts.excluded) << "the state contradicts the filter";
    if (!is_fused(state) && next == SourceState::kProbation) {
      ASSERT_TRUE(facts.readmitted);
    }
    if (is_fused(state) && next == SourceState::kProbation) {
      ASSERT_TRUE(state == SourceState::kProbation && facts.watched);
    }
    ASSERT_EQ(next == SourceState::kReadmitting, facts.excluded && facts.agrees);
    seen.insert({state, next});
    state = next;
  }
  // Probation begins by a readmission alone; everything else can follow everything.
  EXPECT_EQ(seen.size(), 25U - 2U);
  EXPECT_EQ(seen.count({SourceState::kUsed, SourceState::kProbation}), 0U);
  EXPECT_EQ(seen.count({SourceState::kSuspect, SourceState::kProbation}), 0U);
}

TEST(SourceMonitor, EveryStateHasAWayBackToUse) {
  for (const SourceState begin : kStates) {
    std::set<SourceState> reached = {begin};
    for (std::size_t size = 0; size != reached.size();) {
      size = reached.size();
      for (const SourceState state : std::set<SourceState>(reached)) {
        for (unsigned bits = 0; bits < 32U; ++bits) {
          reached.insert(next_state(state, facts_of(bits)));
        }
      }
    }
    EXPECT_EQ(reached.size(), kStates.size());
  }
}

TEST(SourceMonitor, ARelapseDoublesTheTimeOfAgreement) {
  SourceMonitor monitor(from_seconds(5.0));
  Stamp now(from_seconds(100.0));
  const Duration first = monitor.wait();
  monitor.exclude(now);
  EXPECT_EQ(monitor.wait(), first);
  Duration last = first;
  for (int relapse = 0; relapse < 10; ++relapse) {
    monitor.readmit(now += from_seconds(20.0));
    EXPECT_TRUE(monitor.on_probation(now));
    monitor.exclude(now += from_seconds(30.0));
    EXPECT_GE(monitor.wait(), last);
    last = monitor.wait();
  }
  EXPECT_EQ(last, from_seconds(300.0));
  monitor.readmit(now += from_seconds(400.0));
  EXPECT_FALSE(monitor.recently_readmitted(now + from_seconds(70.0)));
  monitor.exclude(now += from_seconds(70.0));
  EXPECT_EQ(monitor.wait(), first);
}

TEST(SourceMonitor, AReadmittedSourceIsOnProbationUntilItsTimeIsOver) {
  SourceMonitor monitor(from_seconds(5.0));
  const auto at = [](double t_s) { return Stamp(from_seconds(100.0 + t_s)); };
  monitor.step(false, true, false, at(0.0));
  EXPECT_EQ(monitor.state(), SourceState::kSuspect);
  monitor.step(true, false, false, at(1.0));
  EXPECT_EQ(monitor.state(), SourceState::kExcluded);
  monitor.step(true, false, true, at(2.0));
  EXPECT_EQ(monitor.state(), SourceState::kReadmitting);
  monitor.readmit(at(3.0));
  monitor.step(false, false, false, at(3.0));
  EXPECT_EQ(monitor.state(), SourceState::kProbation);
  monitor.step(false, false, false, at(7.9));
  EXPECT_EQ(monitor.state(), SourceState::kProbation);
  monitor.step(false, false, false, at(8.0));
  EXPECT_EQ(monitor.state(), SourceState::kUsed);
}

}  // namespace
}  // namespace rcs::wm

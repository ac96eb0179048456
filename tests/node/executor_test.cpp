#include "rcs/node/executor.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <string>

#include "tests/node/fixtures.h"

namespace rcs {
namespace {

using test::at_ms;
using test::ms;

/// Time that passes only where a test advances it: a cycle lasts as long as its node specifies.
class FakeTimeline final : public Timeline {
 public:
  explicit FakeTimeline(Stamp end) : end_(end) {}
  [[nodiscard]] Stamp now() const override { return now_; }
  Step advance(Stamp until) override {
    if (std::max(until, now_) >= end_) return Step::kEnded;
    now_ = std::max(now_, until);
    return Step::kReached;
  }
  void begin_cycle(Duration) override {}
  Stamp end_cycle() override { return now_; }
  void pass(Duration d) { now_ += d; }

 private:
  Stamp now_ = at_ms(1000);
  Stamp end_;
};

class Periodic final : public Node {
 public:
  using Load = std::function<Duration(int index)>;
  Periodic(std::string name, Duration period, Duration budget, FakeTimeline* timeline, Load load)
      : info_{std::move(name), budget, Duration::zero()},
        clock_(period),
        timeline_(timeline),
        load_(std::move(load)) {}

  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {}; }
  [[nodiscard]] std::int64_t missed_cycles() const override { return clock_.missed(); }
  void run(const Cycle& cycle) override {
    starts.push_back((cycle.now - at_ms(1000)) / ms(1));
    wakeups.push_back((cycle.wakeup - at_ms(1000)) / ms(1));
    clock_.advance(cycle.now);
    timeline_->pass(load_(static_cast<int>(cycle.index)));
    cycle.stages->close_account();
  }

  std::vector<std::int64_t> starts;
  std::vector<std::int64_t> wakeups;

 private:
  NodeInfo info_;
  PeriodicClock clock_;
  FakeTimeline* timeline_;
  Load load_;
};

struct Accounts final : CycleSink {
  void on_account(const NodeInfo&, const CycleAccount& a) override {
    late.push_back(a.late / ms(1));
    slack.push_back(a.slack / ms(1));
    missed = a.missed;
    overruns = a.overruns;
  }
  std::vector<std::int64_t> late;
  std::vector<std::int64_t> slack;
  std::int64_t missed = 0;
  std::int64_t overruns = 0;
};

using Numbers = std::vector<std::int64_t>;

TEST(Executor, APeriodicNodeKeepsItsPhase) {
  FakeTimeline timeline(at_ms(1100));
  Periodic node("wm", ms(20), ms(10), &timeline, [](int) { return ms(3); });
  Accounts accounts;
  const RunReport report = run({&node}, timeline, &accounts);
  EXPECT_EQ(node.starts, (Numbers{0, 20, 40, 60, 80}));
  EXPECT_EQ(accounts.late, (Numbers{0, 0, 0, 0, 0}));
  EXPECT_EQ(accounts.slack, (Numbers{7, 7, 7, 7, 7}));
  EXPECT_EQ(report.nodes[0].cycles, 5);
  EXPECT_EQ(report.nodes[0].missed, 0);
  EXPECT_EQ(report.nodes[0].overruns, 0);
}

TEST(Executor, AnOverrunIsCountedSkipsWholePeriodsAndIsNotMadeUpFor) {
  // Cycle 1 starts at 20 and takes 55 ms. The cycle due at 40 starts late, at 75; the one due at 60
  // is skipped; the one due at 80 is in phase.
  FakeTimeline timeline(at_ms(1130));
  Periodic node("wm", ms(20), ms(10), &timeline, [](int i) { return i == 1 ? ms(55) : ms(1); });
  Accounts accounts;
  const RunReport report = run({&node}, timeline, &accounts);
  EXPECT_EQ(node.starts, (Numbers{0, 20, 75, 80, 100, 120}));
  EXPECT_EQ(node.wakeups, (Numbers{0, 20, 40, 80, 100, 120}));
  EXPECT_EQ(accounts.late, (Numbers{0, 0, 35, 0, 0, 0}));
  EXPECT_EQ(accounts.slack, (Numbers{9, -45, -26, 9, 9, 9}));
  EXPECT_EQ(report.nodes[0].missed, 1);
  EXPECT_EQ(report.nodes[0].overruns, 2);
  EXPECT_EQ(report.nodes[0].worst_late, ms(35));
  EXPECT_EQ(accounts.missed, 1);
  EXPECT_EQ(accounts.overruns, 2);
}

TEST(Executor, TheEarliestDueCycleRunsFirstAndTiesFollowTheListOrder) {
  FakeTimeline timeline(at_ms(1030));
  std::string order;
  Periodic a("a", ms(10), ms(10), &timeline, [&](int) { return order += 'a', ms(1); });
  Periodic b("b", ms(10), ms(10), &timeline, [&](int) { return order += 'b', ms(1); });
  Periodic c("c", ms(4), ms(10), &timeline, [&](int) { return order += 'c', ms(0); });
  run({&a, &b, &c}, timeline, nullptr);
  // Starts: a 0, b 1, c 2; then c 6, a 10 and c 10 (a is first in the list), b 11, c 14 ...
  EXPECT_EQ(order.substr(0, 7), "abccacb");
}

TEST(Executor, AnAccountThatIsNotClosedIsNotReported) {
  class EveryThird final : public Node {
   public:
    [[nodiscard]] const NodeInfo& info() const override { return info_; }
    [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
    [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {}; }
    void run(const Cycle& cycle) override {
      clock_.advance(cycle.now);
      if (cycle.index % 3 == 2) cycle.stages->close_account();
    }

   private:
    NodeInfo info_{"sp", ms(10), ms(0)};
    PeriodicClock clock_{ms(10)};
  } node;
  FakeTimeline timeline(at_ms(1090));
  Accounts accounts;
  const RunReport report = run({&node}, timeline, &accounts);
  EXPECT_EQ(report.nodes[0].cycles, 9);
  EXPECT_EQ(accounts.late.size(), 3U);
}

TEST(Executor, TheReportNamesNodesAndInputs) {
  LocalBus bus;
  test::Echo node({"sp", ms(10), ms(1)}, &bus, "ODOMETRY", "END", 1);
  test::ListSource source(test::odometry_items(at_ms(0), ms(0), 4));  // all at once: 3 are dropped
  LockstepTimeline timeline(&bus, &source, ms(10));
  const RunReport report = run({&node}, timeline, nullptr);
  ASSERT_EQ(report.nodes.size(), 1U);
  ASSERT_EQ(report.nodes[0].inputs.size(), 1U);
  EXPECT_EQ(report.nodes[0].inputs[0].channel, "ODOMETRY");
  EXPECT_EQ(report.nodes[0].inputs[0].account.dropped, 3);
  EXPECT_NE(report.text().find("ODOMETRY"), std::string::npos);
}

TEST(PeriodicClock, CountsWholePeriodsThatPassed) {
  PeriodicClock clock(ms(10));
  clock.advance(at_ms(5));  // sets the phase: 5, 15, 25, ...
  EXPECT_EQ(clock.next(), at_ms(15));
  EXPECT_FALSE(clock.due(at_ms(14)));
  clock.advance(at_ms(15));
  EXPECT_EQ(clock.missed(), 0);
  clock.advance(at_ms(34));  // serves 25, late
  EXPECT_EQ(clock.next(), at_ms(35));
  EXPECT_EQ(clock.missed(), 0);
  clock.advance(at_ms(55));  // serves 35; 45 and 55 have passed
  EXPECT_EQ(clock.next(), at_ms(65));
  EXPECT_EQ(clock.missed(), 2);
}

}  // namespace
}  // namespace rcs

#include "tools/rcs/vehicle/supervisor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rcs::cli {

bool operator==(const SupervisorAction& a, const SupervisorAction& b) {
  return a.kind == b.kind && a.node == b.node;
}
std::ostream& operator<<(std::ostream& out, const SupervisorAction& o) {
  return out << "{" << static_cast<int>(o.kind) << ", node " << o.node << "}";
}

namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Kind = SupervisorAction::Kind;

constexpr Stamp at_s(double s) { return Stamp(from_seconds(s)); }
std::vector<bool> all_critical(std::size_t nodes) { return std::vector<bool>(nodes, true); }
constexpr Exit kCrash{true, 11};
constexpr Exit kRefusal{false, 1};

/// Node 0 with a heartbeat every second from `from` to `to`.
void live(Supervisor* s, double from_s, double to_s) {
  for (double t = from_s; t <= to_s; t += 1.0) s->on_alive(0, at_s(t));
}

/// The waits [ms] before each restart of a node that never becomes alive.
std::vector<std::int64_t> backoffs_of(Supervisor* s, int deaths, const Exit& exit) {
  std::vector<std::int64_t> waits;
  Stamp now = at_s(0.0);
  for (int i = 0; i < deaths; ++i) {
    EXPECT_THAT(s->due(now), ElementsAre(SupervisorAction{Kind::kStart, 0}));
    const std::optional<Duration> wait = s->on_exit(0, exit, now);
    if (!wait) break;
    waits.push_back(wait->count() / 1000);
    EXPECT_THAT(s->due(now + *wait - Duration(1)), IsEmpty());
    now += *wait;
    EXPECT_EQ(s->next(), now);
  }
  return waits;
}

TEST(Supervisor, StartsAllInOrderAndThenWaitsForHeartbeats) {
  Supervisor s(all_critical(3), {});
  EXPECT_LE(s.next(), at_s(1.0));
  EXPECT_THAT(s.due(at_s(1.0)),
              ElementsAre(SupervisorAction{Kind::kStart, 0}, SupervisorAction{Kind::kStart, 1},
                          SupervisorAction{Kind::kStart, 2}));
  EXPECT_THAT(s.due(at_s(1.0)), IsEmpty());
  EXPECT_EQ(s.next(), at_s(16.0));
  EXPECT_FALSE(s.finished());
}

TEST(Supervisor, TheWaitBeforeARestartDoublesUpToTenSeconds) {
  Supervisor s(all_critical(1), {});
  EXPECT_THAT(backoffs_of(&s, 9, kCrash),
              ElementsAre(200, 400, 800, 1600, 3200, 6400, 10'000, 10'000, 10'000));
}

TEST(Supervisor, HalfAMinuteOfHealthResetsTheWait) {
  for (const double life_s : {29.0, 31.0}) {
    Supervisor s(all_critical(1), {});
    (void)backoffs_of(&s, 3, kCrash);
    EXPECT_THAT(s.due(at_s(10.0)), ElementsAre(SupervisorAction{Kind::kStart, 0}));
    live(&s, 10.0, 10.0 + life_s);
    const std::optional<Duration> wait = s.on_exit(0, kCrash, at_s(10.0 + life_s));
    ASSERT_TRUE(wait);
    EXPECT_EQ(*wait, life_s < 30.0 ? from_seconds(1.6) : from_seconds(0.2)) << life_s;
  }
}

TEST(Supervisor, ACriticalNodeThatFailsItsFirstStartsEndsEverything) {
  Supervisor s(all_critical(2), {});
  (void)s.due(at_s(0.0));
  s.on_alive(1, at_s(0.1));
  Stamp now = at_s(0.1);
  for (int i = 0; i < 2; ++i) {
    const std::optional<Duration> wait = s.on_exit(0, kRefusal, now);
    ASSERT_TRUE(wait);
    now += *wait;
    EXPECT_THAT(s.due(now), ElementsAre(SupervisorAction{Kind::kStart, 0}));
  }
  EXPECT_FALSE(s.on_exit(0, kRefusal, now));
  EXPECT_EQ(s.gave_up_on(), 0U);
  EXPECT_LE(s.next(), now);
  EXPECT_THAT(s.due(now), ElementsAre(SupervisorAction{Kind::kTerminate, 1}));
  EXPECT_FALSE(s.finished());
  EXPECT_FALSE(s.on_exit(1, {false, 0}, now));
  EXPECT_TRUE(s.finished());
}

TEST(Supervisor, ANodeThatCannotRestartIsRetriedEveryTenSecondsAndTheOthersContinue) {
  // A critical node that was alive before, and a non-critical node that never was alive.
  for (const bool critical : {true, false}) {
    Supervisor s({critical, true}, {});
    (void)s.due(at_s(0.0));
    s.on_alive(1, at_s(0.1));
    if (critical) s.on_alive(0, at_s(0.1));
    Stamp now = at_s(0.2);
    std::vector<std::int64_t> waits;
    for (int i = 0; i < 6; ++i) {
      EXPECT_EQ(s.failing(0), i >= 3) << i;
      s.on_alive(1, now);
      const std::optional<Duration> wait = s.on_exit(0, kRefusal, now);
      ASSERT_TRUE(wait) << i;
      waits.push_back(wait->count() / 1000);
      for (now += *wait; s.next() < now;) s.on_alive(1, s.next());
      s.on_alive(1, now);
      EXPECT_THAT(s.due(now), ElementsAre(SupervisorAction{Kind::kStart, 0}));
    }
    // The end of a healthy run is no failed start.
    EXPECT_THAT(waits, ElementsAre(200, 400, critical ? 800 : 10'000, 10'000, 10'000, 10'000));
    EXPECT_FALSE(s.stopping());
    EXPECT_FALSE(s.gave_up_on());
    EXPECT_FALSE(s.failing(1));

    s.on_alive(0, now);
    EXPECT_TRUE(s.failing(0)) << "it may exit again at once";
    s.on_alive(0, now + from_seconds(30.0));
    EXPECT_FALSE(s.failing(0));
  }
}

TEST(Supervisor, ACrashOrAHealthyRunIsNoFailedStart) {
  Supervisor s(all_critical(1), {});
  EXPECT_EQ(backoffs_of(&s, 8, kCrash).size(), 8U);
  EXPECT_FALSE(s.gave_up_on());
  Supervisor t(all_critical(1), {});
  Stamp now = at_s(0.0);
  for (int i = 0; i < 8; ++i) {
    EXPECT_THAT(t.due(now), ElementsAre(SupervisorAction{Kind::kStart, 0}));
    if (i % 2 == 0) t.on_alive(0, now);
    const std::optional<Duration> wait = t.on_exit(0, kRefusal, now);
    ASSERT_TRUE(wait) << i;
    now += *wait;
  }
}

TEST(Supervisor, ASilentNodeIsKilledAndRestarted) {
  Supervisor s(all_critical(1), {});
  (void)s.due(at_s(0.0));
  live(&s, 1.0, 40.0);
  EXPECT_EQ(s.next(), at_s(45.0));
  EXPECT_THAT(s.due(at_s(44.9)), IsEmpty());
  EXPECT_THAT(s.due(at_s(45.0)), ElementsAre(SupervisorAction{Kind::kKillSilent, 0}));
  EXPECT_THAT(s.due(at_s(46.0)), IsEmpty());
  s.on_alive(0, at_s(46.0));  // its last heartbeat
  EXPECT_EQ(s.next(), Stamp::max());
  EXPECT_EQ(s.on_exit(0, {true, 9}, at_s(46.0)), from_seconds(0.2));
}

TEST(Supervisor, ANodeWithoutAFirstHeartbeatIsKilledLater) {
  Supervisor s(all_critical(1), {});
  (void)s.due(at_s(0.0));
  EXPECT_THAT(s.due(at_s(14.9)), IsEmpty());
  EXPECT_THAT(s.due(at_s(15.0)), ElementsAre(SupervisorAction{Kind::kKillUnstarted, 0}));
}

TEST(Supervisor, StopTerminatesThenKillsAndStartsNothing) {
  Supervisor s(all_critical(3), {});
  (void)s.due(at_s(0.0));
  s.on_alive(0, at_s(0.5));
  ASSERT_TRUE(s.on_exit(2, kCrash, at_s(0.5)));
  s.stop();
  EXPECT_LE(s.next(), at_s(1.0));
  EXPECT_THAT(s.due(at_s(1.0)), ElementsAre(SupervisorAction{Kind::kTerminate, 0},
                                            SupervisorAction{Kind::kTerminate, 1}));
  EXPECT_EQ(s.next(), at_s(4.0));
  EXPECT_FALSE(s.on_exit(0, {false, 0}, at_s(1.1)));
  EXPECT_FALSE(s.finished());
  EXPECT_THAT(s.due(at_s(4.0)), ElementsAre(SupervisorAction{Kind::kKillUnstopped, 1}));
  EXPECT_FALSE(s.on_exit(1, {true, 9}, at_s(4.1)));
  EXPECT_TRUE(s.finished());
  EXPECT_FALSE(s.gave_up_on());
}

}  // namespace
}  // namespace rcs::cli

#include "modules/gateway/command_arbiter.h"

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "tests/gateway/operator_command_samples.h"

namespace rcs::gateway {
namespace {

using test::go_to;
using test::halt;
using Kind = Action::Kind;
using Phase = CommandArbiter::Phase;

constexpr Stamp at(double s) { return Stamp() + from_seconds(s); }

std::optional<Kind> kind(const std::optional<Action>& action) {
  if (!action) return std::nullopt;
  return action->kind;
}

/// An arbiter whose decision is requested every 50 ms.
struct Shift {
  CommandArbiter arbiter{ArbiterParams{}};
  Progress progress = Progress::kUnderway;
  double t = 0.0;
  int sent = 0;
  Stamp valid_until = Stamp::min();  // of the newest GOTO

  /// Until `end`; `each` is called before every decision.
  template <class Each>
  void until(double end, Each&& each) {
    for (; t < end; t += 0.05) {
      each();
      const std::optional<Action> action = arbiter.decide(at(t), progress);
      if (!action) continue;
      ++sent;
      if (action->kind == Kind::kGoto) valid_until = at(t) + action->valid_for;
    }
  }
  void until(double end) {
    until(end, [] {});
  }
};

TEST(CommandArbiter, ACommandIsSentAtOnceAndRefreshedEverySecondWhileItsOperatorRepeatsIt) {
  Shift run;
  run.until(10.0,
            [&] { EXPECT_EQ(run.arbiter.accept(go_to("alice", 1), at(run.t)), Refusal::kNone); });
  // The validity is extended whenever that gains a whole second.
  EXPECT_GE(run.sent, 9);
  EXPECT_LE(run.sent, 11);
  EXPECT_EQ(run.arbiter.phase(), Phase::kGoto);
}

TEST(CommandArbiter, TheVehicleAlwaysHasAValidCommandWhileItsOperatorRepeatsIt) {
  for (const double valid_for : {0.6, 1.0, 2.0, 5.0}) {
    Shift run;
    WaypointCommand order = go_to("alice", 1);
    order.valid_for = from_seconds(valid_for);
    double next = 0.0;
    run.until(10.0, [&] {
      if (run.t >= next) {
        EXPECT_EQ(run.arbiter.accept(order, at(run.t)), Refusal::kNone);
        next = run.t + 0.2;
      }
      if (run.sent > 0) {
        EXPECT_GT(run.valid_until, at(run.t)) << valid_for;
      }
    });
    EXPECT_LE(run.sent, 60) << "refreshed more often than the operator repeats it";
  }
}

TEST(CommandArbiter, SilenceEndsTheCommandWithinItsOwnValidity) {
  Shift run;
  (void)run.arbiter.accept(go_to("alice", 1), at(0.0));
  run.until(10.0);
  EXPECT_EQ(run.arbiter.phase(), Phase::kSilent);
  EXPECT_LE(run.valid_until, at(2.0)) << "valid for 2 s after the operator's last command";
  EXPECT_EQ(run.arbiter.accept(go_to("alice", 1), at(10.0)), Refusal::kStale)
      << "after silence the operator must send a new command";
  EXPECT_EQ(run.arbiter.accept(go_to("alice", 2), at(10.0)), Refusal::kNone);
  EXPECT_EQ(kind(run.arbiter.decide(at(10.0), Progress::kUnderway)), Kind::kGoto);
}

TEST(CommandArbiter, AStopOnSilenceIsNoFailure) {
  CommandArbiter arbiter{ArbiterParams{}};
  (void)arbiter.accept(go_to("alice", 1), at(0.0));
  (void)arbiter.decide(at(0.0), Progress::kUnderway);
  (void)arbiter.decide(at(2.0), Progress::kError);
  EXPECT_EQ(arbiter.phase(), Phase::kSilent);
}

TEST(CommandArbiter, ADoneOrFailedCommandIsNotRefreshed) {
  for (const Progress end : {Progress::kDone, Progress::kError}) {
    Shift run;
    const auto speak = [&] {
      EXPECT_EQ(run.arbiter.accept(go_to("alice", 1), at(run.t)), Refusal::kNone);
    };
    run.until(0.5, speak);
    run.progress = end;
    const int before = run.sent;
    run.until(5.0, speak);
    EXPECT_EQ(run.sent, before);
    EXPECT_EQ(run.arbiter.phase(), end == Progress::kDone ? Phase::kDone : Phase::kFailed);
  }
}

TEST(CommandArbiter, TheProgressOfAnOlderActionIsIgnoredForANewCommand) {
  CommandArbiter arbiter{ArbiterParams{}};
  (void)arbiter.accept(go_to("alice", 1), at(0.0));
  (void)arbiter.decide(at(0.0), Progress::kUnderway);
  (void)arbiter.decide(at(0.1), Progress::kDone);
  ASSERT_EQ(arbiter.phase(), Phase::kDone);
  (void)arbiter.accept(go_to("alice", 2), at(0.2));
  EXPECT_EQ(kind(arbiter.decide(at(0.2), Progress::kDone)), Kind::kGoto);
  EXPECT_EQ(arbiter.phase(), Phase::kGoto);
}

TEST(CommandArbiter, IdsIncreaseAndAnIdHasOneContent) {
  CommandArbiter arbiter{ArbiterParams{}};
  EXPECT_EQ(arbiter.accept(go_to("alice", 5), at(0.0)), Refusal::kNone);
  EXPECT_EQ(arbiter.accept(go_to("alice", 4), at(0.1)), Refusal::kStale);
  WaypointCommand other = go_to("alice", 5);
  other.waypoints[0].speed_mps = 4.0;
  EXPECT_EQ(arbiter.accept(other, at(0.1)), Refusal::kChanged);
  EXPECT_EQ(arbiter.accept(go_to("alice", 5), at(0.1)), Refusal::kNone);
}

TEST(CommandArbiter, OneOperatorIsInCommandAndAnyOperatorMayHalt) {
  CommandArbiter arbiter{ArbiterParams{}};
  (void)arbiter.accept(go_to("alice", 5), at(0.0));
  EXPECT_EQ(arbiter.accept(go_to("bob", 1), at(0.1)), Refusal::kHeld);
  EXPECT_EQ(arbiter.accept(halt("bob", 2), at(0.2)), Refusal::kNone);
  EXPECT_EQ(kind(arbiter.decide(at(0.2), Progress::kUnderway)), Kind::kHalt);
  EXPECT_EQ(kind(arbiter.decide(at(0.3), Progress::kUnderway)), std::nullopt) << "once";
  EXPECT_EQ(arbiter.accept(halt("bob", 2), at(0.3)), Refusal::kNone) << "bob repeats his command";
  EXPECT_EQ(arbiter.accept(go_to("alice", 5), at(0.3)), Refusal::kStale)
      << "a halted command stays halted";
  EXPECT_EQ(arbiter.accept(go_to("bob", 1), at(0.4)), Refusal::kStale)
      << "a rejected id stays used";
  EXPECT_EQ(arbiter.accept(go_to("bob", 3), at(0.4)), Refusal::kNone);
}

TEST(CommandArbiter, AStopIsSentAtOnceRepeatedAndEndsTheCommand) {
  Shift run;
  (void)run.arbiter.accept(go_to("alice", 1), at(0.0));
  run.until(0.2);
  EXPECT_EQ(run.arbiter.accept(StopCommand{"bob", 1, true}, at(0.2)), Refusal::kNone);
  EXPECT_EQ(kind(run.arbiter.decide(at(0.2), Progress::kUnderway)), Kind::kEmergencyStop);
  run.sent = 0;
  run.t = 0.25;
  run.until(10.2);
  EXPECT_NEAR(run.sent, 10, 1) << "every second while it is engaged";
  EXPECT_EQ(run.arbiter.accept(go_to("alice", 1), at(10.2)), Refusal::kStale);
  EXPECT_EQ(run.arbiter.accept(go_to("alice", 2), at(10.2)), Refusal::kStopped);
}

TEST(CommandArbiter, AReleaseEndsTheStopOfItsOperatorOnly) {
  CommandArbiter arbiter{ArbiterParams{}};
  (void)arbiter.accept(StopCommand{"alice", 1, true}, at(0.0));
  (void)arbiter.accept(StopCommand{"bob", 1, true}, at(0.0));
  (void)arbiter.decide(at(0.0), Progress::kUnderway);
  EXPECT_EQ(arbiter.accept(StopCommand{"bob", 1, false}, at(0.1)), Refusal::kStale)
      << "the same id";
  EXPECT_EQ(arbiter.accept(StopCommand{"bob", 2, false}, at(0.1)), Refusal::kNone);
  EXPECT_EQ(arbiter.phase(), Phase::kStopped) << "alice's stop stays in force";
  EXPECT_EQ(arbiter.accept(StopCommand{"carol", 2, false}, at(0.2)), Refusal::kNone);
  EXPECT_EQ(arbiter.phase(), Phase::kStopped) << "carol has no stop to release";
  EXPECT_EQ(arbiter.accept(StopCommand{"", 9, false}, at(0.2)), Refusal::kOperator);
  EXPECT_EQ(arbiter.accept(StopCommand{"alice", 2, false}, at(0.3)), Refusal::kNone);
  EXPECT_EQ(kind(arbiter.decide(at(0.3), Progress::kUnderway)), Kind::kRelease);
  EXPECT_EQ(arbiter.accept(go_to("alice", 1), at(0.4)), Refusal::kStopped)
      << "release not accepted yet";
  (void)arbiter.decide(at(0.5), Progress::kDone);
  EXPECT_EQ(arbiter.phase(), Phase::kIdle);
  EXPECT_EQ(arbiter.accept(go_to("alice", 1), at(0.6)), Refusal::kStale)
      << "a command from before the release must not come into force by itself";
  EXPECT_EQ(arbiter.accept(go_to("alice", 2), at(0.6)), Refusal::kNone);
}

TEST(CommandArbiter, AStopOfAnUnknownOperatorStops) {
  CommandArbiter arbiter{ArbiterParams{}};
  EXPECT_EQ(arbiter.accept(StopCommand{"", -7, true}, at(0.0)), Refusal::kNone);
  EXPECT_EQ(kind(arbiter.decide(at(0.0), Progress::kUnderway)), Kind::kEmergencyStop);
  EXPECT_EQ(arbiter.accept(StopCommand{"alice", 1, false}, at(0.1)), Refusal::kNone);
  EXPECT_EQ(kind(arbiter.decide(at(0.1), Progress::kUnderway)), Kind::kRelease);
}

TEST(CommandArbiter, AReleaseFromBeforeThisProcessHasNoEffect) {
  // An old transient-local release arrives at every start; the vehicle may have been stopped again.
  CommandArbiter arbiter{ArbiterParams{}};
  EXPECT_EQ(arbiter.accept(StopCommand{"alice", 9, false}, at(0.0)), Refusal::kNone);
  EXPECT_EQ(kind(arbiter.decide(at(0.0), Progress::kUnderway)), std::nullopt);
}

TEST(CommandArbiter, AReleaseThatTheVehicleRejectsEndsAsAStop) {
  Shift run;
  (void)run.arbiter.accept(StopCommand{"alice", 1, true}, at(0.0));
  run.until(0.1);
  (void)run.arbiter.accept(StopCommand{"alice", 2, false}, at(0.1));
  run.progress = Progress::kError;  // still moving
  run.until(5.0);
  EXPECT_EQ(run.arbiter.phase(), Phase::kReleasing);
  run.until(11.0);
  EXPECT_EQ(run.arbiter.phase(), Phase::kStopped);
  EXPECT_EQ(run.arbiter.accept(StopCommand{"alice", 3, false}, at(11.0)), Refusal::kNone);
  EXPECT_EQ(run.arbiter.phase(), Phase::kReleasing);
}

// An id of 2^63-1 must not make every later command, or the release, of its operator stale.
TEST(CommandArbiter, AnExtremeIdDisablesNothing) {
  CommandArbiter arbiter{ArbiterParams{}};
  EXPECT_EQ(arbiter.accept(go_to("alice", INT64_MAX), at(0.0)), Refusal::kCommandId);
  EXPECT_EQ(arbiter.accept(StopCommand{"alice", INT64_MAX, false}, at(0.0)), Refusal::kCommandId);
  EXPECT_EQ(arbiter.accept(go_to("alice", 1), at(0.1)), Refusal::kNone);
  EXPECT_EQ(arbiter.accept(StopCommand{"alice", INT64_MAX, true}, at(0.2)), Refusal::kNone);
  EXPECT_EQ(kind(arbiter.decide(at(0.2), Progress::kUnderway)), Kind::kEmergencyStop);
  EXPECT_EQ(arbiter.accept(StopCommand{"alice", 2, false}, at(0.3)), Refusal::kNone);
  EXPECT_EQ(arbiter.phase(), Phase::kReleasing);
  EXPECT_EQ(arbiter.accept(StopCommand{"alice", 1, true}, at(0.4)), Refusal::kNone)
      << "an older id";
  EXPECT_EQ(kind(arbiter.decide(at(0.4), Progress::kUnderway)), Kind::kEmergencyStop);
}

TEST(CommandArbiter, ManyOperatorsCannotBlockAStop) {
  CommandArbiter arbiter{ArbiterParams{}};
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(arbiter.accept(StopCommand{"crowd" + std::to_string(i), 1, true}, at(0.0)),
              Refusal::kNone);
  }
  EXPECT_EQ(arbiter.phase(), Phase::kStopped);
  // Stops without an entry of their own count as one anonymous stop.
  for (int i = 0; i < 15; ++i) {
    (void)arbiter.accept(StopCommand{"crowd" + std::to_string(i), 2, false}, at(0.1));
  }
  EXPECT_EQ(arbiter.phase(), Phase::kStopped);
  (void)arbiter.accept(StopCommand{"crowd15", 2, false}, at(0.1));
  EXPECT_EQ(arbiter.phase(), Phase::kReleasing);
}

TEST(CommandArbiter, ManyOperatorsDoNotDisplaceTheOneInCommand) {
  CommandArbiter arbiter{ArbiterParams{}};
  (void)arbiter.accept(go_to("alice", 5), at(0.0));
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(arbiter.accept(go_to("crowd" + std::to_string(i), 1), at(0.1)), Refusal::kHeld);
  }
  EXPECT_EQ(arbiter.accept(go_to("alice", 4), at(0.2)), Refusal::kStale);
  EXPECT_EQ(arbiter.accept(go_to("alice", 5), at(0.2)), Refusal::kNone);
}

}  // namespace
}  // namespace rcs::gateway

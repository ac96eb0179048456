#include "modules/ros2_bridge/input_gate.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace rcs::ros2_bridge {
namespace {

constexpr std::int64_t kUtc = 1'800'000'000'000'000;  // UTC at node time 0
constexpr std::uint64_t kDriver = 10;
constexpr std::uint64_t kOther = 20;

Stamp at_ms(std::int64_t ms) { return Stamp(std::chrono::milliseconds(ms)); }

InputVerdict stamp(InputGate* gate, std::int64_t stamp_ms, std::int64_t now_ms,
                   std::uint64_t publisher = kDriver) {
  return gate->judge_stamp(publisher, kUtc + 1000 * stamp_ms, kUtc + 1000 * now_ms, at_ms(now_ms));
}

TEST(InputGate, AStampMustBePresentAndLaterThanTheLast) {
  struct Step {
    std::int64_t stamp_ms;
    std::int64_t now_ms;
    InputVerdict expected;
  };
  // Default limits: 1000 ms old, 20 ms ahead.
  const Step kSteps[] = {
      {0, 5, InputVerdict::kAccepted},
      {10, 15, InputVerdict::kAccepted},
      {10, 16, InputVerdict::kStampNotLater},  // repeated
      {9, 17, InputVerdict::kStampNotLater},   // back
      {60, 30, InputVerdict::kStampAhead},     // not the newest from now on
      {40, 30, InputVerdict::kAccepted},       // within the limit
      {45, 1046, InputVerdict::kStampOld},
      {50, 1046, InputVerdict::kAccepted},
      {2'000'000'000, 1100, InputVerdict::kStampAhead},
      {-kUtc / 1000, 1100, InputVerdict::kStampOld},  // 1970
      {1090, 1100, InputVerdict::kAccepted},
  };
  InputGate gate(100.0, {});
  for (const Step& s : kSteps) {
    EXPECT_EQ(stamp(&gate, s.stamp_ms, s.now_ms), s.expected)
        << s.stamp_ms << " at " << s.now_ms << " ms";
  }
}

TEST(InputGate, ASourceThatWasSetBackIsAcceptedAfterItsStampsHaveIncreasedForTheTime) {
  StampLimits limits;
  limits.max_age = from_seconds(1000.0);
  InputGate gate(100.0, limits);
  EXPECT_EQ(stamp(&gate, 100'000, 100'000), InputVerdict::kAccepted);
  int rejected = 0;
  InputVerdict last = InputVerdict::kStampNotLater;
  for (std::int64_t t = 100; last == InputVerdict::kStampNotLater; t += 100, ++rejected) {
    ASSERT_LT(t, 10'000);
    last = stamp(&gate, 50'000 + t, 100'000 + t);
  }
  EXPECT_EQ(last, InputVerdict::kRestarted);
  EXPECT_EQ(rejected, 21) << "2 s, and the one that is accepted";
  EXPECT_EQ(stamp(&gate, 52'300, 102'300), InputVerdict::kAccepted);
}

TEST(InputGate, RepeatedStampsAreNotARestart) {
  InputGate gate(100.0, {from_seconds(1000.0), from_seconds(0.0), from_seconds(2.0)});
  EXPECT_EQ(stamp(&gate, 0, 0), InputVerdict::kAccepted);
  for (int t = 100; t < 20'000; t += 100) {
    ASSERT_EQ(stamp(&gate, -10, t), InputVerdict::kStampNotLater);
  }
}

TEST(InputGate, OnePublisherOwnsTheInputUntilItIsSilent) {
  InputGate gate(100.0, {});
  for (int t = 0; t < 1000; t += 100) {
    ASSERT_EQ(gate.judge_arrival(kDriver, at_ms(t)), InputVerdict::kAccepted);
    ASSERT_EQ(stamp(&gate, t, t), InputVerdict::kAccepted);
    EXPECT_EQ(gate.judge_arrival(kOther, at_ms(t + 50)), InputVerdict::kSecondPublisher);
  }
  EXPECT_EQ(gate.judge_arrival(kOther, at_ms(3000)), InputVerdict::kSecondPublisher);
  EXPECT_EQ(gate.judge_arrival(kOther, at_ms(3900)), InputVerdict::kAccepted);
  EXPECT_EQ(stamp(&gate, 3900, 3900, kOther), InputVerdict::kAccepted);
  EXPECT_EQ(gate.judge_arrival(kDriver, at_ms(3950)), InputVerdict::kSecondPublisher);
}

TEST(InputGate, MessagesThatAreRejectedDoNotKeepTheOwner) {
  InputGate gate(100.0, {});
  EXPECT_EQ(gate.judge_arrival(kDriver, at_ms(0)), InputVerdict::kAccepted);
  EXPECT_EQ(stamp(&gate, 0, 0), InputVerdict::kAccepted);
  for (int t = 100; t < 5000; t += 100) {
    (void)gate.judge_arrival(kDriver, at_ms(t));
    (void)stamp(&gate, 0, t);  // a frozen driver
  }
  EXPECT_EQ(gate.judge_arrival(kOther, at_ms(5000)), InputVerdict::kAccepted);
}

TEST(InputGate, AFloodIsLimitedToTheRate) {
  for (const double rate_hz : {1.0, 20.0, 200.0}) {
    InputGate gate(rate_hz, {});
    int accepted = 0;
    for (int i = 0; i < 100'000; ++i) {  // 10 s
      const Stamp now = from_utime(100LL * i);
      accepted += gate.judge_arrival(kDriver, now) == InputVerdict::kAccepted ? 1 : 0;
    }
    EXPECT_NEAR(accepted, 10.0 * rate_hz, std::max(3.0, 0.3 * rate_hz));
    // At its rate, and in bursts of a tenth of a second, everything is accepted.
    InputGate usual(rate_hz, {});
    for (int i = 0; i < 1000; ++i) {
      const auto now_us = static_cast<std::int64_t>(1e6 * i / rate_hz);
      ASSERT_EQ(usual.judge_arrival(kDriver, from_utime(now_us / 100'000 * 100'000)),
                InputVerdict::kAccepted)
          << i;
    }
  }
}

TEST(UtcOffset, LateReadingsAndStepsAreDistinguished) {
  UtcOffset offset;
  std::int64_t now_us = 1000;
  const auto read = [&](std::int64_t true_us, std::int64_t late_us) {
    now_us += 10'000;
    return offset.add(now_us + true_us + late_us, from_utime(now_us));
  };
  EXPECT_EQ(offset.us(), 0);
  EXPECT_EQ(read(kUtc, 300), Duration(0));
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(read(kUtc, i % 7 == 0 ? 50'000 : i % 5), Duration(0)) << "preempted: no step";
    ASSERT_LE(offset.us(), kUtc + 300);
    ASSERT_GE(offset.us(), kUtc);
  }
  EXPECT_NEAR(static_cast<double>(read(kUtc - 2'000'000, 0).count()), -2e6, 400.0)
      << "backwards: at once";
  Duration step(0);
  int readings = 0;
  for (; step == Duration(0) && readings < 200; ++readings) step = read(kUtc + 3'000'000, 10);
  EXPECT_NEAR(static_cast<double>(step.count()), 5e6, 400.0);
  EXPECT_LE(readings, 2 * UtcOffset::kWindow) << "forwards: after two windows at most";
}

}  // namespace
}  // namespace rcs::ros2_bridge

// Distinction of clock steps from silences, latencies, disorder and single wrong stamps.
#include "modules/wm/clock_watch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <vector>

namespace rcs::wm {
namespace {

constexpr Duration kPeriod = from_milliseconds(10.0);

struct Seen {
  std::vector<ClockStep> steps;
  int samples = 0;   // samples passed on, held before or not
  int odometry = 0;  // samples of the wheels that were accepted
  Duration shift{};  // at the end
  Duration longest_hold{};
};

void add(const ImuSample& imu, Stamp now, ClockWatch* watch, Seen* seen) {
  if (watch->add(imu, now) != ClockWatch::Verdict::kPass) return;
  seen->samples += 1 + static_cast<int>(watch->held().size());
  watch->clear_held();
}

void resolve(Stamp now, ClockWatch* watch, Seen* seen) {
  const std::optional<ClockStep> step = watch->resolve(now);
  if (!step) return;
  seen->steps.push_back(*step);
  seen->samples += static_cast<int>(watch->held().size());
  watch->clear_held();
}

/// INS at 100 Hz and odometry at 20 Hz for 20 s.
/// @param ins, odometry  t [s] -> shift of the stamp [s]; none: the message is lost
/// @param latency  t [s] -> of the INS [s]
Seen run(
    const std::function<std::optional<double>(double)>& ins,
    const std::function<std::optional<double>(double)>& odometry,
    const std::function<double(double)>& latency = [](double) { return 0.002; }) {
  ClockWatch watch;
  Seen seen;
  Stamp held_since = Stamp::min();
  for (int i = 1; i < 2000; ++i) {
    const double t = 0.01 * i;
    const Stamp now = Stamp(from_seconds(500.0 + t + latency(t)));
    if (const std::optional<double> shift = ins(t)) {
      const ImuSample imu{Stamp(from_seconds(t + *shift)), kPeriod, Vec3::Zero(), Vec3::Zero()};
      add(imu, now, &watch, &seen);
    }
    if (const std::optional<double> shift = odometry(t); shift && i % 5 == 0) {
      const Stamp stamp(from_seconds(t + *shift));
      if (watch.add(Clock::kOdometry, stamp, Stamp(from_seconds(500.002 + t)))) ++seen.odometry;
    }
    if (!watch.suspects()) held_since = now;
    seen.longest_hold = std::max(seen.longest_hold, now - held_since);
    resolve(now, &watch, &seen);
  }
  seen.shift = watch.ins_shift();
  return seen;
}

std::optional<double> right(double /*t*/) { return 0.0; }

auto shifted(double from_s, double to_s, double by_s) {
  return [=](double t) { return std::optional(t > from_s && t < to_s ? by_s : 0.0); };
}

/// Every sample of the INS is sent again 34 ms later; a clock steps.
/// @param of_all  false: that of the INS alone
Seen run_with_copies(double step_s, bool of_all) {
  ClockWatch watch;
  Seen seen;
  std::vector<ImuSample> sent;
  for (int i = 1; i < 2000; ++i) {
    const double t = 0.01 * i;
    const double by_s = t > 10.003 ? step_s : 0.0;
    const Vec3 noise(1e-4 * std::sin(1e3 * i), 0.0, 0.0);
    sent.push_back({Stamp(from_seconds(t + by_s)), kPeriod, noise, Vec3::Zero()});
    add(sent.back(), Stamp(from_seconds(500.0 + t)), &watch, &seen);
    if (i > 3) add(sent[sent.size() - 4], Stamp(from_seconds(500.004 + t)), &watch, &seen);
    const Stamp now(from_seconds(500.005 + t));
    if (i % 5 == 0) {
      const double of_wheels_s = of_all ? by_s : 0.0;
      if (watch.add(Clock::kOdometry, Stamp(from_seconds(t + of_wheels_s)), now)) ++seen.odometry;
    }
    resolve(now, &watch, &seen);
  }
  seen.shift = watch.ins_shift();
  return seen;
}

TEST(ClockWatch, CopiesOfSamplesHideNoStep) {
  for (const double by_s : {0.2, -0.2, -0.5468, -0.55, -3.0}) {
    for (const bool of_all : {true, false}) {
      const Seen seen = run_with_copies(by_s, of_all);
      ASSERT_EQ(seen.steps.size(), 1U) << by_s << of_all;
      EXPECT_EQ(seen.steps[0].of_all, of_all) << by_s;
      EXPECT_NEAR(seconds(seen.steps[0].step), by_s, 1e-3);
      EXPECT_EQ(seen.samples, 1999) << "each sample once";
      EXPECT_GT(seen.odometry, 380);
    }
  }
}

TEST(ClockWatch, PermanentAndTemporaryStepsOfAllClocksAreFollowed) {
  for (const double by_s : {0.05, 0.2, 3.0, 40.0, -0.2, -3.0}) {
    const Seen stays = run(shifted(10.003, 1e9, by_s), shifted(10.003, 1e9, by_s));
    ASSERT_EQ(stays.steps.size(), 1U) << by_s;
    EXPECT_TRUE(stays.steps[0].of_all) << by_s;
    EXPECT_NEAR(seconds(stays.steps[0].step), by_s, 1e-3);
    EXPECT_EQ(stays.shift, Duration::zero());
    EXPECT_EQ(stays.samples, 1999) << "no sample is lost";
    EXPECT_LT(stays.longest_hold, from_milliseconds(120.0));
    const Seen returns = run(shifted(10.003, 15.003, by_s), shifted(10.003, 15.003, by_s));
    ASSERT_EQ(returns.steps.size(), 2U) << by_s;
    EXPECT_TRUE(returns.steps[1].of_all) << by_s;
    EXPECT_NEAR(seconds(returns.steps[1].step), -by_s, 1e-3);
  }
}

TEST(ClockWatch, ARepeatedOldInsSampleIsNoStepAndHoldsNothing) {
  for (const double behind_s : {0.01, 0.05, 1.0}) {
    const auto stuck = [behind_s](double t) {
      return std::optional(t > 10.003 ? 10.0 - behind_s - t : 0.0);
    };
    const Seen seen = run(stuck, right);
    EXPECT_EQ(seen.steps.size(), 0U) << behind_s;
    EXPECT_EQ(seen.shift, Duration::zero()) << behind_s;
    EXPECT_LT(seen.longest_hold, from_milliseconds(30.0)) << behind_s;
  }
}

TEST(ClockWatch, AStepOfTheInsAloneShiftsItsStampsBack) {
  for (const double by_s : {0.05, 0.2, 3.0, -0.2}) {
    const Seen stays = run(shifted(10.003, 1e9, by_s), right);
    ASSERT_EQ(stays.steps.size(), 1U) << by_s;
    EXPECT_FALSE(stays.steps[0].of_all) << by_s;
    EXPECT_NEAR(seconds(stays.shift), -by_s, 1e-3);
    const Seen returns = run(shifted(10.003, 15.003, by_s), right);
    EXPECT_EQ(returns.shift, Duration::zero()) << by_s;
  }
}

TEST(ClockWatch, AClockOfTheInsThatReturnsWhileNothingElseIsReceivedIsOfTheInsAlone) {
  for (const double by_s : {0.2, 3.0, -0.2, -3.0}) {
    const auto silent_later = [](double t) { return t > 13.0 ? std::nullopt : std::optional(0.0); };
    const Seen seen = run(shifted(10.003, 15.003, by_s), silent_later);
    ASSERT_EQ(seen.steps.size(), 2U) << by_s;
    EXPECT_FALSE(seen.steps[1].of_all) << by_s;
    EXPECT_EQ(seen.shift, Duration::zero()) << by_s;
  }
}

TEST(ClockWatch, AStepThatWasPresumedOfAllIsTakenBackWhenAnotherSourceHasNotStepped) {
  for (const double by_s : {0.05, 0.2, 3.0, -0.05, -0.2, -3.0}) {
    for (const bool of_all : {true, false}) {
      const auto wheels = [=](double t) {
        return t > 9.0 && t < 14.0 ? std::nullopt : std::optional(of_all && t > 9.0 ? by_s : 0.0);
      };
      const Seen seen = run(shifted(10.003, 1e9, by_s), wheels);
      ASSERT_EQ(seen.steps.size(), of_all ? 1U : 2U) << by_s;
      EXPECT_TRUE(seen.steps[0].of_all) << by_s;
      if (of_all) continue;
      EXPECT_NEAR(seconds(seen.steps[1].step), -by_s, 1e-3);
      EXPECT_NEAR(seconds(seen.shift), -by_s, 1e-3);
    }
  }
}

TEST(ClockWatch, ASourceWhoseLatencyWasUnknownTakesNothingBack) {
  for (const double by_s : {3.0, -3.0}) {
    for (const double begin_s : {9.75, 14.0}) {  // five messages before the step, or none
      const auto wheels = [=](double t) {
        const bool received = t > begin_s && (t < 10.003 || t > 14.0);
        return received ? std::optional(t > 10.003 ? by_s : 0.0) : std::nullopt;
      };
      const Seen seen = run(shifted(10.003, 1e9, by_s), wheels);
      ASSERT_EQ(seen.steps.size(), 1U) << by_s;
      EXPECT_TRUE(seen.steps[0].of_all) << by_s;
      EXPECT_EQ(seen.shift, Duration::zero()) << by_s;
    }
  }
}

TEST(ClockWatch, AStuckSourceDoesNotShowItsClock) {
  const auto stuck = [](double t) { return std::optional(t > 9.503 ? 9.5 - t : 0.0); };
  const Seen seen = run(shifted(10.003, 1e9, -3.0), stuck);
  ASSERT_EQ(seen.steps.size(), 1U);
  EXPECT_TRUE(seen.steps[0].of_all) << "presumed";
}

TEST(ClockWatch, ASilenceIsNoStep) {
  for (const double length_s : {0.1, 0.3, 1.0, 3.0}) {
    const auto silent = [=](double t) {
      return t > 10.0 && t < 10.0 + length_s ? std::nullopt : std::optional(0.0);
    };
    EXPECT_TRUE(run(silent, silent).steps.empty()) << length_s;
    EXPECT_TRUE(run(silent, right).steps.empty()) << length_s;
  }
}

TEST(ClockWatch, LateAndBunchedSamplesAreNoStep) {
  // The sender stalls for 0.3 s every 2 s, and all waiting samples arrive at once.
  const auto stalls = [](double t) {
    const double into = t - 2.0 * std::floor(t / 2.0);
    return into < 0.3 ? 0.302 - into : 0.002;
  };
  EXPECT_TRUE(run(right, right, stalls).steps.empty());
}

// When the delay ends, samples of the right time arrive among the delayed ones.
TEST(ClockWatch, ADelayThatEndsIsNoStep) {
  ClockWatch watch;
  std::multimap<Stamp, Stamp> stamp_by_arrival;
  for (int i = 1; i < 2000; ++i) {
    const double t = 0.01 * i;
    const double latency = t > 5.0 && t < 10.0 ? 0.387 : 0.002;
    stamp_by_arrival.emplace(Stamp(from_seconds(500.0 + t + latency)), Stamp(from_seconds(t)));
  }
  for (const auto& [arrival, stamp] : stamp_by_arrival) {
    static_cast<void>(watch.add(ImuSample{stamp, kPeriod, Vec3::Zero(), Vec3::Zero()}, arrival));
    static_cast<void>(watch.add(Clock::kOdometry, Stamp(arrival - from_seconds(500.0)), arrival));
    EXPECT_FALSE(watch.resolve(arrival)) << seconds(stamp.time_since_epoch());
    watch.clear_held();
  }
  EXPECT_EQ(watch.ins_shift(), Duration::zero());
}

TEST(ClockWatch, OneWrongStampIsNoStep) {
  for (const double by_s : {-5.0, -0.1, 0.3, 100.0}) {
    EXPECT_TRUE(run(shifted(10.003, 10.013, by_s), right).steps.empty()) << by_s;
  }
}

TEST(ClockWatch, DisorderIsNoStep) {
  // Every second sample arrives after its successor.
  const auto swapped = [](double t) {
    const int i = static_cast<int>(std::lround(t / 0.01));
    return std::optional(i % 2 == 0 ? -0.01 : 0.01);
  };
  const Seen seen = run(swapped, right);
  EXPECT_TRUE(seen.steps.empty());
  EXPECT_GT(seen.samples, 1900);
  EXPECT_EQ(seen.odometry, 399) << "the inputs of the others are not dropped meanwhile";
}

TEST(ClockWatch, AWrongStampOfAnInsThatThenFallsSilentDropsNoOtherInput) {
  for (const double by_s : {-0.02, -0.3, 0.06, 0.3}) {
    const auto dies = [by_s](double t) {
      return t < 10.003 ? std::optional(0.0) : t < 10.013 ? std::optional(by_s) : std::nullopt;
    };
    const Seen seen = run(dies, right);
    EXPECT_TRUE(seen.steps.empty()) << by_s;
    EXPECT_EQ(seen.odometry, 399) << by_s;
    EXPECT_LT(seen.longest_hold, from_milliseconds(400.0)) << by_s;
  }
}

// The clock of the sensors is slower than that of this computer by as much as two oscillators
// differ: what the stamps were ahead of the arrivals an hour ago is no measure of a step.
TEST(ClockWatch, AfterAnHourOfDriftAStepOfTheInsAloneIsRecognized) {
  for (const double slower : {20e-6, 50e-6, -50e-6}) {
    for (const double by_s : {-0.3, -0.1, 0.1, 0.15}) {
      ClockWatch watch;
      std::vector<ClockStep> steps;
      for (int i = 1; i <= 361'000; ++i) {
        const double t = 0.01 * i;
        const double stamp_s = t * (1.0 - slower);
        const Stamp now(from_seconds(500.002 + t));
        const double step_s = t > 3600.003 ? by_s : 0.0;
        const ImuSample imu{Stamp(from_seconds(stamp_s + step_s)), kPeriod, Vec3::Zero(),
                            Vec3::Zero()};
        if (watch.add(imu, now) == ClockWatch::Verdict::kPass) watch.clear_held();
        if (i % 5 == 0) {
          static_cast<void>(watch.add(Clock::kOdometry, Stamp(from_seconds(stamp_s)), now));
        }
        if (const std::optional<ClockStep> step = watch.resolve(now)) {
          steps.push_back(*step);
          watch.clear_held();
        }
      }
      ASSERT_EQ(steps.size(), 1U) << slower << " " << by_s;
      EXPECT_FALSE(steps[0].of_all) << slower << " " << by_s;
      EXPECT_NEAR(seconds(watch.ins_shift()), -by_s, 1e-3) << slower << " " << by_s;
    }
  }
}

}  // namespace
}  // namespace rcs::wm

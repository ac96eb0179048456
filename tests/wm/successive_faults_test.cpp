// A source that fails while another one is excluded, or that falls silent before it is excluded.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <utility>

#include "tests/wm/fault_drive.h"

namespace rcs::wm {
namespace {

/// Fixes that jump from side to side: neither a cluster nor a drift, and never accepted.
Vec3 scattered(double t_s) {
  return {std::fmod(t_s, 0.4) < 0.2 ? 30.0 : -30.0, 30.0 * std::sin(3.0 * t_s), 0.0};
}

double first(const Seen& seen, Finding what) {
  for (const auto& [t_s, finding] : seen.findings) {
    if (finding == what) return t_s;
  }
  return 1e9;
}

// A fix that is not fused neither agrees with an INS that is tried again nor contradicts it.
TEST(SuccessiveFaults, TheInsIsReadmittedWhileGpsIsExcluded) {
  const InsFault fault = gyro_bias({0.0, 0.0, 3.0});
  Disturbance d;
  d.fix_off = [](double t) { return t > 30.0 ? scattered(t) : Vec3(Vec3::Zero()); };
  d.ins = [&fault](double t, ImuSample* imu) {
    if (t > 50.0 && t < 55.0) fault.apply(imu);
  };
  const Seen seen = drive(120.0, d, 1, 30.0);
  EXPECT_TRUE(excluded(seen.gps));
  EXPECT_LT(first(seen, Finding::kInsFaulty), 55.0);
  EXPECT_LT(first(seen, Finding::kInsReadmitted), 80.0);
  EXPECT_EQ(seen.ins, SourceStatus::kFully);
  EXPECT_EQ(seen.beyond_protection, 0);
}

// The wrong fixes say nothing about the INS: its sub-filters are renewed meanwhile.
TEST(SuccessiveFaults, AnInsFaultIsFoundWhileGpsIsExcludedAndReceived) {
  for (const bool received : {false, true}) {
    Disturbance d;
    d.fix_off = [](double t) { return t > 30.0 ? scattered(t) : Vec3(Vec3::Zero()); };
    d.has_fix = [received](double t) { return received || t < 30.0; };
    const InsFault fault = accel_bias({0.5, 0.0, 0.0});
    d.ins = [&fault](double t, ImuSample* imu) {
      if (t > 130.0) fault.apply(imu);
    };
    const Seen seen = drive(145.0, d, 1, 30.0);
    const double found_s = first(seen, Finding::kInsFaulty);
    std::printf("received %d: found at %.1f s, worst %.2f m\n", received, found_s, seen.worst_m);
    EXPECT_LT(found_s, 136.0) << received;
    EXPECT_EQ(seen.beyond_protection, 0) << received;
  }
}

// Each gap ends the sub-filters, and they branch five seconds after the last one.
TEST(SuccessiveFaults, AnInsWhoseGapsPreventItsTestsIsAnAlert) {
  for (const double every_s : {4.0, 40.0}) {
    Disturbance d;
    d.has_ins = [every_s](double t) { return t < 30.0 || std::fmod(t, every_s) > 0.08; };
    const Seen seen = drive(90.0, d, 1, 30.0);
    EXPECT_EQ(seen.first_ins_alert_s > 0.0, every_s < 20.0) << every_s;
    EXPECT_EQ(seen.beyond_protection, 0) << every_s;
  }
}

// The LADAR is one of three that contradict each other.
TEST(SuccessiveFaults, StuckWheelsAreExcludedAlsoWithAFaultyIns) {
  for (const double speed_mps : {0.0, 11.0}) {
    for (const bool ins_silent : {true, false}) {
      Disturbance d;
      d.has_fix = [](double t) { return t < 35.0; };
      d.has_ins = [&](double t) { return !ins_silent || t < 40.0; };
      d.ins = [](double t, ImuSample* imu) {
        if (t > 40.0) imu->delta_angle *= 0.85;
      };
      d.wheels = [&](double t, OdometrySample* wheels) {
        if (t > 42.0) wheels->speed_mps = speed_mps;
        if (t > 42.0) wheels->yaw_rate_radps = 0.0;
      };
      const Seen seen = drive(80.0, d, 1, 30.0);
      std::printf("%.0f m/s, INS silent %d: worst %.2f m, outside %d of %d\n", speed_mps,
                  ins_silent, seen.worst_m, seen.beyond_protection, seen.samples);
      EXPECT_LT(first(seen, Finding::kOdometryFaulty), 47.0) << speed_mps << ins_silent;
      EXPECT_LT(seen.worst_m, 5.0) << speed_mps << ins_silent;
    }
  }
}

// The filter rejects the wheels until it is uncertain, after the gap.
TEST(SuccessiveFaults, WheelsThatWereRejectedAreNotUsedAfterAGapOfTheIns) {
  for (const double bias_mps : {2.5, -2.5}) {
    Disturbance d;
    d.has_fix = [](double t) { return t < 30.0; };
    d.has_ins = [](double t) { return t < 45.0 || t > 45.6; };
    d.wheels = [=](double t, OdometrySample* wheels) {
      if (t > 35.0 && t < 55.0) wheels->speed_mps += bias_mps;
    };
    const Seen seen = drive(80.0, d, 1, 30.0);
    std::printf("%.1f m/s: worst %.2f m\n", bias_mps, seen.worst_m);
    EXPECT_LT(first(seen, Finding::kOdometryFaulty), 38.5) << bias_mps;
    EXPECT_LT(first(seen, Finding::kOdometryReadmitted), 80.0) << bias_mps;
    EXPECT_LT(seen.worst_m, 1.5) << bias_mps;
    EXPECT_EQ(seen.beyond_protection, 0) << bias_mps;
  }
}

// Of noisy wheels the filter accepts the samples that agree with its own error.
TEST(SuccessiveFaults, NoisyWheelsThatAreMostlyRejectedAreExcluded) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    std::mt19937 random(seed);
    std::normal_distribution<double> noise(0.0, 1.7);
    Disturbance d;
    d.has_fix = [](double t) { return t < 30.0; };
    d.wheels = [&](double t, OdometrySample* wheels) {
      if (t > 35.0 && t < 65.0) wheels->speed_mps += noise(random);
    };
    const Seen seen = drive(90.0, d, seed, 30.0);
    std::printf("worst %.2f m, outside %d\n", seen.worst_m, seen.beyond_protection);
    EXPECT_LT(first(seen, Finding::kOdometryFaulty), 45.0) << seed;
    EXPECT_FALSE(seen.found(Finding::kLadarFaulty) || seen.found(Finding::kInsFaulty)) << seed;
    EXPECT_LT(seen.worst_m, 2.0) << seed;
    EXPECT_EQ(seen.beyond_protection, 0) << seed;
  }
}

// Where the LADAR observes hardly any heading, a filter by the LADAR alone agrees with any.
TEST(SuccessiveFaults, WithoutWheelsAnInsIsNotReadmittedForAgreeingWithAnUncertainFilter) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 30.0; };
  d.match = [](double, RollingMatch* match) {
    match->information.row(5) *= 1e-4;
    match->information.col(5) *= 1e-4;
  };
  d.ins = [](double t, ImuSample* imu) {
    if (t > 40.0 && t < 70.0) imu->delta_angle.z() += 0.03 * seconds(imu->interval);
  };
  d.wheels = [](double t, OdometrySample* wheels) {
    if (t < 42.0 || t > 75.0) return;
    wheels->speed_mps = 11.0;
    wheels->yaw_rate_radps = 0.0;
  };
  const Seen seen = drive(80.0, d, 1, 30.0);
  std::printf("worst %.2f m, outside %d of %d\n", seen.worst_m, seen.beyond_protection,
              seen.samples);
  EXPECT_GT(first(seen, Finding::kInsReadmitted), 70.0);
}

// The gyro keeps roll and pitch: a bias of the forces is none of the tilt.
TEST(SuccessiveFaults, AnInsIsReadmittedWithItsBiasAndNotWithAnotherTilt) {
  for (const double bias_mps2 : {0.57, -0.57}) {
    const InsFault fault = accel_bias({bias_mps2, 0.0, 0.0});
    Disturbance d;
    d.has_fix = [](double t) { return t < 30.0; };
    d.ins = [&fault](double t, ImuSample* imu) {
      if (t > 40.0) fault.apply(imu);
    };
    const Seen seen = drive(100.0, d, 1, 30.0);
    std::printf("%.2f m/s2: height off by %.2f m, outside %d of %d\n", bias_mps2, seen.end_up_m,
                seen.above_protection, seen.samples);
    EXPECT_LT(std::abs(seen.end_up_m), 0.6) << bias_mps2;
    EXPECT_EQ(seen.above_protection, 0) << bias_mps2;
  }
}

// Spoofed first and jammed before the test has decided.
TEST(SuccessiveFaults, AWrongGpsThatFallsSilentLeavesNoErrorBeyondTheLevel) {
  for (const auto& [drift_mps, after_s] : {std::pair{0.3, 6.0},
                                           {0.3, 8.0},
                                           {0.3, 9.0},
                                           {0.6, 3.0},
                                           {0.6, 4.0},
                                           {0.6, 5.0},
                                           {0.15, 9.0},
                                           {1.0, 5.0}}) {
    Disturbance d;
    d.fix_off = [mps = drift_mps](double t) -> Vec3 {
      return {mps * std::max(0.0, t - 30.0), 0.0, 0.0};
    };
    d.has_fix = [until_s = 30.0 + after_s](double t) { return t < until_s; };
    const Seen seen = drive(80.0, d, 1, 30.0);
    std::printf("%.2f m/s, silent after %.1f s: worst %.2f m, outside %d\n", drift_mps, after_s,
                seen.worst_m, seen.beyond_protection);
    EXPECT_FALSE(seen.found(Finding::kLadarFaulty)) << drift_mps << " " << after_s;
    EXPECT_LT(seen.worst_m, 3.0) << drift_mps << " " << after_s;
    EXPECT_EQ(seen.beyond_protection, 0) << drift_mps << " " << after_s;
  }
}

// A scan seldom observes the whole pose there: the map of a LADAR that is right again is taken as
// SP has placed it.
TEST(SuccessiveFaults, ALadarThatIsRightAgainIsReadmittedOnFlatGround) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 30.0; };
  d.match_off = [](double t) {
    return Vec3(t < 50.0 ? std::max(0.0, t - 35.0) * 0.4 : 6.0, 0.0, 0.0);
  };
  d.match = [](double t, RollingMatch* match) {
    if (t < 45.0) return;
    for (const int axis : {0, 1, 5}) {
      match->information.row(axis).setZero();
      match->information.col(axis).setZero();
    }
  };
  const Seen seen = drive(110.0, d, 1, 30.0);
  EXPECT_LT(first(seen, Finding::kLadarFaulty), 50.0);
  EXPECT_LT(first(seen, Finding::kLadarReadmitted), 110.0);
}

}  // namespace
}  // namespace rcs::wm

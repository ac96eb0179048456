// Wheels with a wrong speed: they are excluded where they contradict two other sources, no other
// source is, and when the fault is over they are readmitted.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "tests/wm/fault_drive.h"

namespace rcs::wm {
namespace {

constexpr double kFault_s = 30.0;
constexpr double kOver_s = 60.0;
constexpr double kEnd_s = 100.0;

/// @param information  share that the scans have of the usual one, of their position
Disturbance wrong_wheels(double bias_mps, double information) {
  Disturbance d;
  d.match = [=](double, RollingMatch* match) {
    match->information.topLeftCorner<3, 3>() *= information;
  };
  d.wheels = [=](double t, OdometrySample* wheels) {
    if (t > kFault_s && t < kOver_s) wheels->speed_mps += bias_mps;
  };
  return d;
}

bool excluded_another(const Seen& seen) {
  return seen.found(Finding::kGpsFaulty) || seen.found(Finding::kInsFaulty) ||
         seen.found(Finding::kLadarFaulty);
}

TEST(OdometryFault, WithFixesNoOtherSourceIsExcluded) {
  for (const double bias_mps : {-0.6, 0.3, 0.45, 0.6}) {
    const Seen seen = drive(kEnd_s, wrong_wheels(bias_mps, 1e-4));
    std::printf("%.2f m/s: worst %.2f m\n", bias_mps, seen.worst_m);
    EXPECT_FALSE(excluded_another(seen)) << bias_mps;
    EXPECT_LT(seen.worst_m, 2.0) << bias_mps;
    EXPECT_EQ(seen.beyond_protection, 0) << bias_mps;
    if (bias_mps > -0.5) continue;  // the others are too small to contradict the fixes
    EXPECT_TRUE(seen.found(Finding::kOdometryFaulty)) << bias_mps;
    EXPECT_TRUE(seen.found(Finding::kOdometryReadmitted)) << bias_mps;
  }
}

TEST(OdometryFault, WithoutFixesNoOtherSourceIsExcluded) {
  for (const double bias_mps : {-0.6, 0.45, 0.6}) {
    Disturbance d = wrong_wheels(bias_mps, 1e-2);
    d.has_fix = [](double t) { return t < 25.0; };
    const Seen seen = drive(kEnd_s, d);
    std::printf("%.2f m/s: worst %.2f m\n", bias_mps, seen.worst_m);
    EXPECT_FALSE(excluded_another(seen)) << bias_mps;
    EXPECT_LT(seen.worst_m, 2.5) << bias_mps;
    if (bias_mps > -0.5) continue;
    EXPECT_TRUE(seen.found(Finding::kOdometryFaulty)) << bias_mps;
    EXPECT_TRUE(seen.found(Finding::kOdometryReadmitted)) << bias_mps;
  }
}

TEST(OdometryFault, HealthyWheelsAreNotExcludedForADriftOfTheFixes) {
  for (const bool ladar : {true, false}) {
    for (const double rate_mps : {0.3, 0.5, 1.0}) {
      Disturbance d;
      d.fix_off = [=](double t) -> Vec3 {
        return Vec3(0.8, 0.6, 0.0) * rate_mps * std::max(0.0, t - kFault_s);
      };
      d.has_match = [=](double t) { return ladar || t < 25.0; };
      const Seen seen = drive(kOver_s, d);
      std::printf("%.1f m/s%s: worst %.2f m\n", rate_mps, ladar ? "" : ", no LADAR", seen.worst_m);
      EXPECT_FALSE(seen.found(Finding::kOdometryFaulty)) << rate_mps << ", LADAR " << ladar;
    }
  }
}

// The velocity by an INS with a wrong heading is not along the vehicle; its speed is that of the
// wheels.
TEST(OdometryFault, WheelsAreNotBlamedForAHeadingThatTheGyroTurned) {
  Disturbance d;
  d.match = [](double, RollingMatch* match) {
    match->information.row(5) *= 1e-4;
    match->information.col(5) *= 1e-4;
  };
  d.ins = [](double t, ImuSample* imu) {
    if (t > kFault_s && t < kOver_s) imu->delta_angle.z() *= 0.6;
  };
  const Seen seen = drive(kEnd_s, d);
  std::printf("worst %.2f m, outside %d\n", seen.worst_m, seen.beyond_protection);
  EXPECT_FALSE(seen.found(Finding::kOdometryFaulty));
  EXPECT_LT(seen.worst_m, 5.0);
}

/// Without INS the wheels turn the filter, which then rejects the fixes.
TEST(OdometryFault, WithoutInsWheelsThatLadarAndGpsContradictAreExcluded) {
  for (const double bias_dps : {-5.0, 0.0, 4.0}) {
    Disturbance d;
    d.has_ins = [](double t) { return t < kFault_s - 3.0; };
    d.wheels = [=](double t, OdometrySample* wheels) {
      if (t < kFault_s || t > kOver_s) return;
      if (bias_dps == 0.0) wheels->speed_mps *= 1.2;
      wheels->yaw_rate_radps += radians(bias_dps);
    };
    const Seen seen = drive(kOver_s, d, 1, kFault_s);
    std::printf("%.0f deg/s: worst %.2f m, end %.2f m\n", bias_dps, seen.worst_m, seen.end_m);
    EXPECT_TRUE(seen.found(Finding::kOdometryFaulty)) << bias_dps;
    EXPECT_FALSE(excluded_another(seen)) << bias_dps;
    EXPECT_LT(seen.worst_m, 2.0) << bias_dps;
  }
}

/// What wheels measured while the INS was used has not moved the filter: they are right again.
TEST(OdometryFault, WheelsThatWereWrongBeforeTheInsFellSilentAreUsed) {
  Disturbance d;
  d.has_ins = [](double t) { return t < kFault_s; };
  d.wheels = [](double t, OdometrySample* wheels) {
    if (t > kFault_s - 2.0 && t < kFault_s - 0.5) wheels->speed_mps = wheels->yaw_rate_radps = 0.0;
  };
  const Seen seen = drive(kOver_s, d, 1, kFault_s - 3.0);
  EXPECT_FALSE(seen.found(Finding::kOdometryFaulty));
  EXPECT_LT(seen.worst_m, 2.0);
}

TEST(OdometryFault, WithoutInsHealthyWheelsAreUsed) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Disturbance d;
    d.has_ins = [](double t) { return t < kFault_s - 3.0; };
    const Seen seen = drive(kOver_s, d, seed, kFault_s);
    EXPECT_FALSE(seen.found(Finding::kOdometryFaulty)) << seed;
    EXPECT_LT(seen.worst_m, 2.0) << seed;
  }
}

/// Nothing confirms the scans any more: there is no level.
TEST(OdometryFault, WithTheLadarAloneThereIsNoProtectionLevel) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 25.0; };
  d.has_ins = [](double t) { return t < kFault_s; };
  d.wheels = [](double t, OdometrySample* wheels) {
    if (t > kFault_s) wheels->speed_mps = std::numeric_limits<double>::quiet_NaN();
  };
  const Seen seen = drive(kFault_s + 10.0, d, 1, kFault_s + 3.0);
  EXPECT_TRUE(std::isinf(seen.lowest_level_m));
}

/// What has happened meanwhile stays unknown until the position is fixed.
TEST(OdometryFault, AfterTheLadarAloneThereIsNoLevelBeforeTheNextFix) {
  for (const bool fixes : {false, true}) {
    Disturbance d;
    d.has_fix = [=](double t) { return t < 25.0 || (fixes && t > 50.0); };
    d.has_ins = [](double t) { return t < kFault_s || t > kFault_s + 5.0; };
    d.wheels = [](double t, OdometrySample* wheels) {
      if (t > kFault_s && t < kFault_s + 5.0) {
        wheels->speed_mps = std::numeric_limits<double>::quiet_NaN();
      }
    };
    const Seen seen = drive(kEnd_s, d, 1, kFault_s + 3.0);
    EXPECT_EQ(std::isinf(seen.lowest_level_m), !fixes);
  }
}

}  // namespace
}  // namespace rcs::wm

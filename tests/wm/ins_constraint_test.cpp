// Where the LADAR decides nothing, the non-holonomic constraint distinguishes a fault of the INS
// from one of GPS, and finds it without both.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <vector>

#include "tests/wm/fault_drive.h"

namespace rcs::wm {
namespace {

constexpr double kLadarLost_s = 25.0;
constexpr double kFault_s = 45.0;
constexpr double kEnd_s = 60.0;

std::vector<InsFault> faults() {
  return {exchanged_axes(), gyro_bias({0.0, 0.0, 3.0}), accel_bias({0.0, 0.5, 0.0})};
}

/// No scans, and later a fault of the INS to the end.
Disturbance without_ladar(const InsFault& fault) {
  Disturbance d;
  d.has_match = [](double t) { return t < kLadarLost_s; };
  d.ins = [&fault](double t, ImuSample* imu) {
    if (t >= kFault_s) fault.apply(imu);
  };
  return d;
}

TEST(InsConstraint, WithoutLadarTheInsIsExcludedAndNotGps) {
  for (const InsFault& fault : faults()) {
    const Seen seen = drive(kEnd_s, without_ladar(fault), 1, kFault_s);
    std::printf("%s: worst %.2f m, end %.2f m\n", fault.name.c_str(), seen.worst_m, seen.end_m);
    EXPECT_TRUE(seen.found(Finding::kInsFaulty)) << fault.name;
    EXPECT_FALSE(seen.found(Finding::kGpsFaulty)) << fault.name;
    EXPECT_LT(seen.worst_m, 15.0) << fault.name;
    EXPECT_LT(seen.end_m, 1.5) << fault.name;
  }
}

TEST(InsConstraint, WithoutLadarAndGpsTheInsIsExcluded) {
  for (const InsFault& fault : faults()) {
    Disturbance d = without_ladar(fault);
    d.has_fix = [](double t) { return t < kFault_s - 5.0; };
    const Seen seen = drive(kEnd_s, d, 1, kFault_s);
    std::printf("%s: worst %.2f m, end %.2f m\n", fault.name.c_str(), seen.worst_m, seen.end_m);
    EXPECT_TRUE(seen.found(Finding::kInsFaulty)) << fault.name;
    EXPECT_LT(seen.end_m, 8.0) << fault.name;
  }
}

TEST(InsConstraint, WithoutLadarADriftOfTheFixesExcludesGpsAndNotTheIns) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Disturbance d;
    d.has_match = [](double t) { return t < kLadarLost_s; };
    d.fix_off = [](double t) { return Vec3(0.0, t < kFault_s ? 0.0 : 1.5 * (t - kFault_s), 0.0); };
    d.velocity_off = [](double t) { return Vec3(0.0, t < kFault_s ? 0.0 : 1.5, 0.0); };
    const Seen seen = drive(kEnd_s, d, seed, kFault_s);
    EXPECT_TRUE(seen.found(Finding::kGpsFaulty)) << "seed " << seed;
    EXPECT_FALSE(seen.found(Finding::kInsFaulty)) << "seed " << seed;
  }
}

/// A bias of the pitch rate accelerates the vehicle by gravity, and the scans follow the
/// prediction. Wheels and constraint contradict both. A slide would look the same, but no vehicle
/// slides upwards.
TEST(InsConstraint, ALadarThatFollowsTheInsDoesNotConfirmItUpwards) {
  const double bias_radps = radians(0.7);
  Disturbance d;
  d.has_fix = [](double t) { return t < kFault_s - 5.0; };
  d.ins = [=](double t, ImuSample* imu) {
    if (t >= kFault_s) imu->delta_angle.y() += bias_radps * seconds(imu->interval);
  };
  d.match = [=](double t, RollingMatch* match) {
    const double fault_s = std::max(0.0, t - kFault_s);
    Pose& T = match->T_rolling_vehicle;
    T.p += T.q * Vec3(9.81 * bias_radps * fault_s * fault_s * fault_s / 6.0, 0.0, 0.0);
    T.q = T.q * exp_so3(Vec3(0.0, bias_radps * fault_s, 0.0));
  };
  const Seen seen = drive(kFault_s + 9.0, d, 1, kFault_s);
  std::printf("worst %.2f m, outside %d\n", seen.worst_m, seen.beyond_protection);
  EXPECT_TRUE(seen.found(Finding::kInsFaulty));
  EXPECT_FALSE(seen.found(Finding::kOdometryFaulty));
  EXPECT_LT(seen.worst_m, 16.0);
}

/// While the cause of the rejected fixes is open, a gap of the INS ends the sub-filters.
TEST(InsConstraint, AGapOfTheInsWhileGpsIsSuspectLosesNothing) {
  for (const double gap_begin_s : {45.5, 46.2, 47.0}) {
    Disturbance d;
    d.fix_off = [](double t) { return Vec3(t < kFault_s ? 0.0 : 30.0, 0.0, 0.0); };
    d.has_ins = [=](double t) { return t < gap_begin_s || t > gap_begin_s + 0.8; };
    const Seen seen = drive(kEnd_s, d, 1, kFault_s);
    std::printf("gap at %.1f s: worst %.2f m, end %.2f m\n", gap_begin_s, seen.worst_m, seen.end_m);
    EXPECT_LT(seen.worst_m, 3.0) << gap_begin_s;
    EXPECT_FALSE(seen.found(Finding::kInsFaulty)) << gap_begin_s;
    EXPECT_EQ(seen.gps, SourceStatus::kQuarantine) << gap_begin_s;
  }
}

TEST(InsConstraint, ACleanDriveWithoutLadarFindsNothing) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Disturbance d;
    d.has_match = [](double t) { return t < kLadarLost_s; };
    EXPECT_TRUE(drive(90.0, d, seed).findings.empty()) << "seed " << seed;
  }
}

/// The height by dead reckoning may be off by more than it states: the fixes would be accepted in
/// the plane and rejected in height for ever.
TEST(InsConstraint, AfterAnOutageTheHeightOfTheFixesIsAccepted) {
  constexpr double kOff_m = -20.0;
  Disturbance d;
  d.has_fix = [](double t) { return t < 40.0 || t > 60.0; };
  d.fix_off = [](double t) { return Vec3(0.0, 0.0, t < 50.0 ? 0.0 : kOff_m); };
  const Seen seen = drive(90.0, d);
  EXPECT_TRUE(seen.found(Finding::kGpsReadmitted));
  EXPECT_NEAR(seen.end_up_m, kOff_m, 1.0);
  EXPECT_LT(seen.end_m, 1.0);
}

}  // namespace
}  // namespace rcs::wm

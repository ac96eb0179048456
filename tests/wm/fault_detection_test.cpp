// Faulty sources are detected and excluded, the filter is rolled back, and sources without fault
// are readmitted. On synthetic drives; `rcs drill` tests it on whole ones.
#include <gtest/gtest.h>

#include <cmath>

#include "modules/wm/alignment.h"
#include "modules/wm/estimator.h"
#include "tests/wm/fault_drive.h"

namespace rcs::wm {
namespace {

TEST(FaultDetection, NoFaultIsDetectedInACleanDrive) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Seen seen = drive(90.0, {}, seed);
    EXPECT_TRUE(seen.findings.empty()) << "seed " << seed;
    EXPECT_LT(seen.first_alert_s, 0.0) << "seed " << seed;
    EXPECT_LT(seen.first_ladar_alert_s, 0.0) << "seed " << seed;
    EXPECT_EQ(seen.beyond_protection, 0) << "seed " << seed;
    EXPECT_EQ(seen.gps, SourceStatus::kFully);
  }
}

TEST(FaultDetection, NoSubFilterBeforeHeadingAndTiltAreKnown) {
  const Model model{WmParams{}};
  const Stamp now = from_utime(1'000'000'000);
  const auto watched = [&](bool inertial, int badly_known, Duration driven = from_seconds(60.0)) {
    FilterState s{initial_belief(model.params, now), {}};
    s.belief.x.inertial = inertial;
    s.belief.P.diagonal().segment<3>(kAttitude).setConstant(1e-6);
    s.belief.P(kAttitude + badly_known, kAttitude + badly_known) = 2.5e-4;
    s.bookkeeping.georeferenced = true;
    s.bookkeeping.of(Source::kZeroVelocity).accepted = now - driven;
    s.bookkeeping.of(Source::kGpsPosition).accepted = now;
    FaultDetection fault_detection(model.params.fault_detection);
    EXPECT_FALSE(fault_detection.add(model, {now, OdometrySample{}}, nullptr, s).has_value());
    return fault_detection.subfilter(Without::kGps).alive();
  };
  const double limit = model.params.fault_detection.attitude_sigma_rad;
  ASSERT_GT(2.5e-4, limit * limit);
  for (const bool inertial : {true, false}) {
    EXPECT_FALSE(watched(inertial, 2));
    // At rest the heading does not improve: a vehicle whose protection level comes from an old
    // sub-filter would stand for ever.
    EXPECT_TRUE(watched(inertial, 2, from_milliseconds(500.0)));
  }
  // A tilt error makes the INS diverge by gravity; a path by the LADAR alone is only rotated.
  for (const int tilt : {0, 1}) {
    EXPECT_FALSE(watched(true, tilt));
    EXPECT_FALSE(watched(true, tilt, from_milliseconds(500.0)));
    EXPECT_TRUE(watched(false, tilt));
  }
}

TEST(FaultDetection, ARampIsDetectedAndRolledBack) {
  for (const double rate_mps : {0.25, 0.5, 1.0, 5.0}) {
    Disturbance d;
    d.fix_off = [rate_mps](double t) { return Vec3(std::max(0.0, t - 40.0) * rate_mps, 0.0, 0.0); };
    d.velocity_off = [rate_mps](double t) { return Vec3(t > 40.0 ? rate_mps : 0.0, 0.0, 0.0); };
    const Seen seen = drive(90.0, d);
    EXPECT_GT(seen.first_alert_s, 40.0) << rate_mps;
    EXPECT_LT(seen.first_alert_s, rate_mps < 0.5 ? 65.0 : 55.0) << rate_mps;
    EXPECT_LT(seen.worst_m, 4.0) << rate_mps;
    EXPECT_LT(seen.end_m, 2.5) << rate_mps;
    EXPECT_EQ(seen.gps, SourceStatus::kQuarantine) << rate_mps;
    EXPECT_LT(seen.worst_local_step_m, 0.2)
        << rate_mps;  // in 100 ms, including the noise of the true motion
  }
}

TEST(FaultDetection, AJumpIsRejectedAndReadmissionIsQuick) {
  Disturbance d;
  d.fix_off = [](double t) { return Vec3(0.0, t > 40.0 && t < 50.0 ? 25.0 : 0.0, 0.0); };
  const Seen seen = drive(70.0, d);
  EXPECT_LT(seen.worst_m, 1.5);
  ASSERT_TRUE(seen.found(Finding::kGpsReadmitted));
  EXPECT_NEAR(seen.findings.back().first, 52.5, 2.5);
  EXPECT_EQ(seen.gps, SourceStatus::kFully);
}

TEST(FaultDetection, AConsistentClusterAtAWrongPositionIsRejectedAfterAnOutage) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 30.0 || t > 60.0; };
  d.fix_off = [](double t) { return Vec3(t > 60.0 && t < 80.0 ? 50.0 : 0.0, 0.0, 0.0); };
  const Seen seen = drive(95.0, d);
  EXPECT_LT(seen.worst_m, 3.0);
  EXPECT_EQ(seen.beyond_protection, 0);
  EXPECT_FALSE(seen.found(Finding::kFilterFaulty));
  EXPECT_TRUE(seen.found(Finding::kGpsReadmitted));
  EXPECT_EQ(seen.gps, SourceStatus::kFully);
}

TEST(FaultDetection, FixesAfterAnOutageAreQuarantinedAndThenReadmitted) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 30.0 || t > 60.0; };
  const Seen seen = drive(75.0, d);
  ASSERT_TRUE(seen.found(Finding::kGpsReadmitted));
  EXPECT_LT(seen.findings.back().first, 65.0);
  EXPECT_EQ(seen.gps, SourceStatus::kFully);
}

/// When fixes are accepted again that are off by `off_m` after an outage of 40 s; -1: never.
double accepted_after_s(double off_m) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 35.0 || t > 75.0; };
  d.fix_off = [off_m](double t) { return t > 75.0 ? Vec3(off_m, 0.0, 0.0) : Vec3(Vec3::Zero()); };
  for (const auto& [t_s, finding] : drive(105.0, d).findings) {
    if (t_s < 75.0) continue;
    if (finding == Finding::kFilterFaulty || finding == Finding::kGpsReadmitted) return t_s - 75.0;
  }
  return -1.0;
}

TEST(FaultDetection, FixesWithinThePossibleErrorAreAcceptedSoonAfterAnOutage) {
  const double near_s = accepted_after_s(3.5);
  EXPECT_GT(near_s, 0.0);
  EXPECT_LT(near_s, 12.0);
  EXPECT_LT(accepted_after_s(60.0), 0.0) << "within 30 s";
}

TEST(FaultDetection, FixesThatReturnWrongAreContainedInTheLevelAndGivenUpWhenTheyAreRight) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 35.0 || t > 55.0; };
  d.fix_off = [](double t) { return Vec3(t > 55.0 && t < 75.0 ? 4.0 : 0.0, 0.0, 0.0); };
  const Seen seen = drive(95.0, d);
  EXPECT_TRUE(seen.found(Finding::kFilterFaulty));
  EXPECT_GT(seen.worst_m, 3.0);
  EXPECT_EQ(seen.beyond_protection, 0);
  EXPECT_EQ(seen.gps, SourceStatus::kFully);
  EXPECT_LT(seen.end_m, 1.0);
}

TEST(FaultDetection, FixesThatReturnWithADriftDoNotReplaceTheFilter) {
  // A slow one agrees with the filter for some seconds: the level then contains the motion without
  // it, which replaces the filter when it ends.
  for (const auto& [rate_mps, limit_m] : {std::pair{0.2, 6.0}, {0.3, 2.0}, {0.5, 2.0}}) {
    Disturbance d;
    d.sigma_v_mps = 0.1;
    d.has_fix = [](double t) { return t < 35.0 || t > 55.0; };
    d.fix_off = [rate = rate_mps](double t) {
      return Vec3(t < 85.0 ? rate * std::max(0.0, t - 55.0) : 0.0, 0.0, 0.0);
    };
    d.velocity_off = [rate = rate_mps](double t) {
      return Vec3(t > 55.0 && t < 85.0 ? rate : 0.0, 0.0, 0.0);
    };
    const Seen seen = drive(100.0, d);
    EXPECT_FALSE(seen.found(Finding::kFilterFaulty)) << rate_mps;
    EXPECT_FALSE(seen.found(Finding::kInsFaulty)) << rate_mps;
    EXPECT_EQ(seen.found(Finding::kGpsReadmissionRevoked), rate_mps < 0.25) << rate_mps;
    EXPECT_LT(seen.worst_m, limit_m) << rate_mps;
    EXPECT_EQ(seen.beyond_protection, 0) << rate_mps;
    EXPECT_EQ(seen.gps, SourceStatus::kFully) << rate_mps;
  }
}

TEST(FaultDetection, AnInsThatIsFaultyFromTheStartIsExcludedAndTheFilterBeginsAgain) {
  Disturbance d;
  d.sigma_v_mps = 0.1;
  d.ins = [](double t, ImuSample* imu) {
    if (t > 4.0 && t < 8.0) imu->delta_v.y() += 3.0 * seconds(imu->interval);
  };
  const Seen seen = drive(60.0, d, 1, 12.0);
  EXPECT_TRUE(seen.found(Finding::kInsFaulty));
  EXPECT_LT(seen.worst_m, 3.0);
  EXPECT_EQ(seen.beyond_protection, 0);
  EXPECT_EQ(seen.gps, SourceStatus::kFully);
}

TEST(FaultDetection, AMountThatIsTiltedInAnOutageIsContainedInTheVerticalLevel) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 35.0; };
  d.match = [](double t, RollingMatch* match) {
    if (t > 45.0) match->T_rolling_vehicle.p.z() += 0.08 * (t - 45.0);
  };
  const Seen seen = drive(100.0, d);
  EXPECT_EQ(seen.above_protection, 0);
}

TEST(FaultDetection, GapsOfTheInsThatPreventTheTestsRaiseTheLevel) {
  Disturbance d;
  d.has_ins = [](double t) { return t < 30.0 || std::fmod(t, 3.0) > 0.15; };
  const Seen seen = drive(60.0, d);
  EXPECT_GT(seen.first_ins_alert_s, 38.0);
  EXPECT_LT(seen.first_ins_alert_s, 48.0);
  EXPECT_EQ(seen.beyond_protection, 0);
}

TEST(FaultDetection, AHeightFromAnotherGeoidExcludesTheHeightOnly) {
  Disturbance d;
  d.fix_off = [](double t) { return Vec3(0.0, 0.0, t > 40.0 ? 33.0 : 0.0); };
  const Seen seen = drive(70.0, d);
  EXPECT_EQ(seen.gps, SourceStatus::kFully);
  EXPECT_GT(seen.first_alert_s, 40.0);
  EXPECT_LT(seen.worst_m, 1.5);
}

TEST(FaultDetection, ADriftingLadarIsExcludedAfterAnOutage) {
  // GIVEN matches that lose 20 % of the distance in small steps: no gate detects it.
  Disturbance d;
  d.has_fix = [](double t) { return t < 30.0; };
  d.match_off = [](double t) { return Vec3(std::max(0.0, t - 35.0) * 0.4, 0.0, 0.0); };
  const Seen seen = drive(75.0, d);
  EXPECT_GT(seen.first_ladar_alert_s, 35.0);
  EXPECT_LT(seen.worst_m, 8.0);
}

TEST(FaultDetection, AFaultyMapIsExcludedAfterAnOutageAndGpsIsNot) {
  Disturbance d;
  d.has_fix = [](double t) { return t < 35.0 || t > 75.0; };
  d.map_off = [](double t) { return Vec3(0.8 * std::max(0.0, t - 35.0), 0.0, 0.0); };
  const Seen seen = drive(85.0, d);
  EXPECT_TRUE(seen.found(Finding::kMapFaulty));
  EXPECT_FALSE(seen.found(Finding::kGpsFaulty));
  EXPECT_FALSE(seen.found(Finding::kLadarFaulty));
  EXPECT_EQ(seen.gps, SourceStatus::kFully);
  EXPECT_LT(seen.end_m, 1.0);
}

TEST(FaultDetection, AMapIsReadmittedWhenItAgreesWithTheFixes) {
  for (const bool right_again : {true, false}) {
    Disturbance d;
    d.has_fix = [](double t) { return t < 35.0 || t > 75.0; };
    d.map_off = [right_again](double t) {
      return Vec3(right_again && t > 90.0 ? 0.0 : 0.8 * std::max(0.0, t - 35.0), 0.0, 0.0);
    };
    const Seen seen = drive(140.0, d);
    EXPECT_TRUE(seen.found(Finding::kMapFaulty));
    EXPECT_EQ(seen.found(Finding::kMapReadmitted), right_again);
    EXPECT_EQ(seen.gps, SourceStatus::kFully);
    EXPECT_LT(seen.end_m, 1.0);
  }
}

TEST(FaultDetection, ACorrectMapIsKept) {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    Disturbance d;
    d.has_fix = [](double t) { return t < 35.0 || t > 75.0; };
    d.map_off = [](double) { return Vec3(0.5, -0.5, 0.3); };
    const Seen seen = drive(85.0, d, seed);
    EXPECT_FALSE(seen.found(Finding::kMapFaulty)) << "seed " << seed;
    EXPECT_LT(seen.worst_m, 1.5) << "seed " << seed;
  }
}

TEST(GpsSigma, IsBoundedBelowByFixTypeAndGeometry) {
  using Fix = GpsQuality::Fix;
  const Vec3 claims = Vec3::Constant(0.02);
  EXPECT_FALSE(worth(claims, {Fix::kFloat, 3, 1.0, 1.6}));
  EXPECT_GT((*worth(claims, {Fix::kSingle, 9, 1.0, 1.6}))[0], 0.4);
  EXPECT_GT((*worth(claims, {Fix::kFloat, 9, 2.0, 4.0}))[0], 0.09);
  EXPECT_EQ(*worth(claims, {Fix::kFixed, 9, 1.0, 1.6}), claims);
  EXPECT_EQ((*worth(Vec3::Constant(3.0), {Fix::kFixed, 0, 0.0, 0.0}))[0], 3.0);
}

// A streak of the receiver's noise turns the first heading by some standard deviations. The next
// fixes correct it; a motion without fixes that began before would contradict them.
TEST(FaultDetection, AWrongFirstHeadingIsNoFaultOfGps) {
  for (const double off_mps : {0.1, -0.1}) {
    Disturbance d;
    d.velocity_off = [=](double t) {
      return Vec3(t < 7.0 ? off_mps : 0.0, t < 7.0 ? off_mps : 0.0, 0.0);
    };
    const Seen seen = drive(40.0, d, 1, 8.0);
    std::printf("%.1f m/s: worst %.2f m\n", off_mps, seen.worst_m);
    EXPECT_FALSE(seen.found(Finding::kGpsFaulty)) << off_mps;
    EXPECT_LT(seen.worst_m, 2.0) << off_mps;
  }
}

/// The motion by LADAR and wheels is no judge of the fixes.
TEST(FaultDetection, WithoutInsFromTheStartGpsIsKept) {
  for (unsigned seed = 1; seed <= 3; ++seed) {
    Disturbance d;
    d.has_ins = [](double) { return false; };
    d.sigma_v_mps = 0.05;
    const Seen seen = drive(150.0, d, seed, 20.0, radians(25.0));
    std::printf("worst %.2f m, outside %d of %d\n", seen.worst_m, seen.beyond_protection,
                seen.samples);
    EXPECT_FALSE(seen.found(Finding::kGpsFaulty)) << seed;
    EXPECT_LT(seen.worst_m, 2.0) << seed;
  }
}

/// Without a fault of the INS nothing has turned the filter: the fixes are turned.
TEST(FaultDetection, FixesThatAreTurnedDoNotTurnTheFilter) {
  for (const double turned_deg : {-20.0, 8.0, 90.0}) {
    Disturbance d;
    d.sigma_v_mps = 0.05;
    d.turned_rad = [=](double t) { return t > 40.0 ? radians(turned_deg) : 0.0; };
    const Seen seen = drive(100.0, d, 1, 20.0);
    std::printf("%.0f deg: worst %.2f m\n", turned_deg, seen.worst_m);
    EXPECT_EQ(seen.gps, SourceStatus::kQuarantine) << turned_deg;
    EXPECT_LT(seen.worst_m, 2.0) << turned_deg;
    EXPECT_EQ(seen.beyond_protection, 0) << turned_deg;
  }
}

TEST(FaultDetection, FixesThatRiseAreExcludedAndNotReadmitted) {
  for (const double mps : {-0.3, 0.3, 0.6}) {
    Disturbance d;
    d.sigma_v_mps = 0.05;
    d.fix_off = [=](double t) { return Vec3(0.0, 0.0, mps * std::max(0.0, t - 40.0)); };
    d.velocity_off = [=](double t) { return Vec3(0.0, 0.0, t > 40.0 ? mps : 0.0); };
    const Seen seen = drive(110.0, d, 1, 20.0);
    std::printf("%.1f m/s: height off by %.2f m\n", mps, seen.end_up_m);
    EXPECT_EQ(seen.gps, SourceStatus::kQuarantine) << mps;
    EXPECT_FALSE(seen.found(Finding::kInsFaulty)) << mps;
    EXPECT_LT(std::abs(seen.end_up_m), 2.0) << mps;
  }
}

/// Without INS a ramp of the heights is followed. When it ends, the right heights are a jump.
TEST(FaultDetection, WithoutInsHeightsThatComeBackAreBoundedAndAcceptedAfterAMinute) {
  Disturbance d;
  d.has_ins = [](double t) { return t < 35.0; };
  d.fix_off = [](double t) {
    return Vec3(0.0, 0.0, t > 40.0 && t < 65.0 ? 0.5 * (t - 40.0) : 0.0);
  };
  const Seen seen = drive(160.0, d, 1, 67.0);
  std::printf("vertical level up to %.1f m\n", seen.highest_level_up_m);
  EXPECT_GT(seen.highest_level_up_m, 8.0) << "the ramp was followed";
  EXPECT_EQ(seen.above_protection, 0);
  EXPECT_NEAR(seen.end_up_m, 0.0, 1.0);
}

/// Without INS the height drifts, in an outage unseen; afterwards the fixes would be accepted in
/// the plane alone. What jumps from one fix to the next is a fault of GPS.
TEST(FaultDetection, WithoutInsTheHeightsOfTheFixesAreRightAfterAnOutageButNotAfterAJump) {
  Disturbance d;
  d.has_ins = [](double t) { return t < 35.0; };
  double off_m = 25.0;
  d.fix_off = [&off_m](double t) { return Vec3(0.0, 0.0, t > 40.0 ? off_m : 0.0); };
  const Seen jump = drive(60.0, d, 1, 20.0);
  EXPECT_NEAR(jump.end_up_m, 0.0, 1.0);
  EXPECT_FALSE(jump.found(Finding::kGpsFaulty)) << "the positions in the plane are right";
  off_m = 9.0;
  d.has_fix = [](double t) { return t < 40.0 || t > 50.0; };
  EXPECT_NEAR(drive(70.0, d, 1, 20.0).end_up_m, 9.0, 1.0);
  d.has_fix = [](double) { return true; };
  d.has_ins = [](double) { return true; };
  EXPECT_NEAR(drive(60.0, d, 1, 20.0).end_up_m, 0.0, 1.0) << "with an INS they are wrong";
}

}  // namespace
}  // namespace rcs::wm

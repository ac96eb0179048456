// Faults of the INS on synthetic drives: the INS is excluded and named, no other source is, and it
// is readmitted. `rcs drill` tests it with SP on whole drives.
#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

#include "tests/wm/fault_drive.h"

namespace rcs::wm {
namespace {

constexpr double kLength_s = 90.0;
constexpr double kBegin_s = 40.0;
constexpr double kFault_s = 20.0;

/// @param gps_lost  from 5 s before the fault to the end
Seen drive_with(const InsFault& fault, bool gps_lost, unsigned seed) {
  Disturbance d;
  d.has_fix = [gps_lost](double t) { return !gps_lost || t < kBegin_s - 5.0; };
  d.ins = [&fault](double t, ImuSample* imu) {
    if (t >= kBegin_s && t < kBegin_s + kFault_s) fault.apply(imu);
  };
  Seen seen = drive(kLength_s, d, seed, kBegin_s);
  std::printf("%s, GPS %s: worst %.2f m, end %.2f m, outside of the protection level %.1f %%\n",
              fault.name.c_str(), gps_lost ? "lost" : "received", seen.worst_m, seen.end_m,
              100.0 * seen.beyond_protection / seen.samples);
  return seen;
}

bool excluded_another(const Seen& seen) {
  return seen.found(Finding::kGpsFaulty) || seen.found(Finding::kLadarFaulty) ||
         seen.found(Finding::kGpsReadmissionRevoked);
}

std::vector<InsFault> faults() {
  std::vector<InsFault> all;
  for (const double dps : {0.02, 0.05, 0.2, 2.0, 20.0}) {
    all.push_back(gyro_bias({0.0, 0.0, dps}));
    if (dps < 20.0) all.push_back(gyro_bias({dps, 0.0, 0.0}));
  }
  for (const double mps2 : {0.05, 0.2, 1.0}) {
    all.push_back(accel_bias({mps2, 0.0, 0.0}));
    all.push_back(accel_bias({0.0, mps2, 0.0}));
    all.push_back(accel_bias({0.0, 0.0, mps2}));
  }
  all.push_back({"gyro 0", [](ImuSample* imu) { imu->delta_angle.setZero(); }});
  all.push_back({"gyro x 1.1", [](ImuSample* imu) { imu->delta_angle *= 1.1; }});
  all.push_back({"gyro x -1", [](ImuSample* imu) { imu->delta_angle *= -1.0; }});
  all.push_back(exchanged_axes());
  return all;
}

TEST(InsFault, IsFoundAndNoOtherSourceIsExcludedWithGps) {
  for (const InsFault& fault : faults()) {
    const Seen seen = drive_with(fault, false, 1);
    EXPECT_FALSE(excluded_another(seen)) << fault.name;
    EXPECT_EQ(seen.gps, SourceStatus::kFully) << fault.name;
    EXPECT_LT(seen.end_m, 1.0) << fault.name;
    if (!fault.large) continue;
    EXPECT_TRUE(seen.found(Finding::kInsFaulty)) << fault.name;
    EXPECT_TRUE(seen.found(Finding::kInsReadmitted)) << fault.name;
    EXPECT_LT(seen.worst_m, 7.0) << fault.name;
  }
}

TEST(InsFault, IsFoundWithoutGps) {
  for (const InsFault& fault : faults()) {
    const Seen seen = drive_with(fault, true, 1);
    if (!fault.large) continue;
    EXPECT_TRUE(seen.found(Finding::kInsFaulty)) << fault.name;
    // Without a test of the INS the error grows to hundreds of metres.
    EXPECT_LT(seen.worst_m, 6.0) << fault.name;
  }
}

/// On dunes the registrations observe no heading: they follow that of the INS.
Disturbance on_dunes() {
  Disturbance d;
  d.match = [](double, RollingMatch* match) {
    constexpr double kSigma_rad = 0.03;
    match->information.row(5).setZero();
    match->information.col(5).setZero();
    match->information(5, 5) = 1.0 / (kSigma_rad * kSigma_rad);
  };
  return d;
}

TEST(InsFault, OfTheGyroIsFoundByTheCourseOfTheFixesWhereTheLadarObservesNoHeading) {
  for (const double dps : {0.6, -1.0, 2.0}) {
    Disturbance d = on_dunes();
    const InsFault fault = gyro_bias({0.0, 0.0, dps});
    d.ins = [&fault](double t, ImuSample* imu) {
      if (t >= kBegin_s && t < kBegin_s + kFault_s) fault.apply(imu);
    };
    const Seen seen = drive(kLength_s, d, 1, kBegin_s);
    std::printf("%s: worst %.2f m, outside %d of %d\n", fault.name.c_str(), seen.worst_m,
                seen.beyond_protection, seen.samples);
    EXPECT_TRUE(seen.found(Finding::kInsFaulty)) << fault.name;
    EXPECT_EQ(seen.gps, SourceStatus::kFully) << fault.name;
    EXPECT_LT(seen.worst_m, 2.0) << fault.name;
    EXPECT_EQ(seen.beyond_protection, 0) << fault.name;
  }
}

TEST(InsFault, ADriftOfTheFixesIsNoFaultOfTheInsWhereTheLadarObservesNoHeading) {
  for (const Vec3& mps : {Vec3(0.6, 0.0, 0.0), Vec3(0.0, 0.6, 0.0), Vec3(-1.5, 1.5, 0.0)}) {
    Disturbance d = on_dunes();
    const auto faulty = [](double t) { return t >= kBegin_s && t < kBegin_s + kFault_s; };
    d.fix_off = [&](double t) -> Vec3 {
      return faulty(t) ? Vec3((t - kBegin_s) * mps) : Vec3(Vec3::Zero());
    };
    d.velocity_off = [&](double t) -> Vec3 { return faulty(t) ? mps : Vec3(Vec3::Zero()); };
    const Seen seen = drive(kLength_s, d, 1, kBegin_s);
    std::printf("%.1f %.1f m/s: worst %.2f m, outside %d of %d\n", mps.x(), mps.y(), seen.worst_m,
                seen.beyond_protection, seen.samples);
    EXPECT_FALSE(seen.found(Finding::kInsFaulty)) << mps.transpose();
    EXPECT_TRUE(seen.found(Finding::kGpsFaulty)) << mps.transpose();
    EXPECT_LT(seen.worst_m, 3.0) << mps.transpose();
    EXPECT_EQ(seen.beyond_protection, 0) << mps.transpose();
  }
}

TEST(InsFault, TheInsIsNotReadmittedDuringAFaultThatTheWheelsShow) {
  for (const double dps : {0.6, -1.0, 2.0}) {
    Disturbance d = on_dunes();
    const InsFault fault = gyro_bias({0.0, 0.0, dps});
    d.has_fix = [](double t) { return t < kBegin_s - 5.0; };
    d.ins = [&fault](double t, ImuSample* imu) {
      if (t >= kBegin_s && t < kBegin_s + kFault_s) fault.apply(imu);
    };
    const Seen seen = drive(kLength_s, d, 1, kBegin_s);
    EXPECT_TRUE(seen.found(Finding::kInsFaulty)) << fault.name;
    EXPECT_FALSE(seen.forces_excluded) << fault.name << ": a wrong rotation was used";
    for (const auto& [t_s, finding] : seen.findings) {
      if (finding != Finding::kInsReadmitted) continue;
      EXPECT_GT(t_s, kBegin_s + kFault_s) << fault.name;
    }
    std::printf("%s: worst %.2f m, outside %d of %d\n", fault.name.c_str(), seen.worst_m,
                seen.beyond_protection, seen.samples);
    EXPECT_LT(seen.worst_m, 10.0) << fault.name;
    EXPECT_EQ(seen.beyond_protection, 0) << fault.name;
  }
}

/// A fault 35 s after the loss of GPS. The sub-filters from before the loss are too uncertain by
/// then.
Disturbance late_in_an_outage() {
  Disturbance d;
  d.has_fix = [](double t) { return t < 20.0; };
  d.ins = [](double t, ImuSample* imu) {
    if (t > 55.0) imu->delta_v.z() += 1.0 * seconds(imu->interval);
  };
  return d;
}

TEST(InsFault, IsFoundLateInAnOutage) {
  const Seen seen = drive(65.0, late_in_an_outage(), 1, 55.0);
  ASSERT_TRUE(seen.found(Finding::kInsFaulty));
  EXPECT_LT(seen.findings.front().first, 58.5);
  EXPECT_EQ(seen.beyond_protection, 0);
}

TEST(InsFault, IsFoundAfterAChangeOfTheMapEpoch) {
  // SP loses its map a second after the fault begins, because the INS predicts wrongly.
  Disturbance d = late_in_an_outage();
  Pose T_old_new;
  bool replaced = false;
  d.match = [&](double t, RollingMatch* match) {
    if (t < 56.0) return;
    const Pose T_old_vehicle = match->T_rolling_vehicle;
    if (!replaced) T_old_new = T_old_vehicle;
    match->map_epoch = 2;
    match->seeded = !replaced;
    match->T_rolling_vehicle = T_old_new.inverse() * T_old_vehicle;
    replaced = true;
  };
  const Seen seen = drive(65.0, d, 1, 55.0);
  ASSERT_TRUE(seen.found(Finding::kInsFaulty));
  EXPECT_LT(seen.findings.front().first, 60.0);
}

TEST(InsFault, UntilItIsFoundTheProtectionLevelContainsTheError) {
  for (const Vec3& mps2 : {Vec3(0.5, 0.0, 0.0), Vec3(0.0, 0.5, 0.0)}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const InsFault fault = accel_bias(mps2);
      const Seen seen = drive_with(fault, true, seed);
      EXPECT_EQ(seen.beyond_protection, 0) << fault.name << ", seed " << seed;
    }
  }
}

// The height is off by metres before the tests, which are late by the lag of the history, can know.
TEST(InsFault, UntilItIsFoundTheVerticalLevelContainsWhatTheMatchesContradict) {
  const InsFault fault{"forces x 0.75", [](ImuSample* imu) { imu->delta_v *= 0.75; }};
  for (const bool gps_lost : {false, true}) {
    const Seen seen = drive_with(fault, gps_lost, 1);
    EXPECT_TRUE(seen.found(Finding::kInsFaulty));
    EXPECT_EQ(seen.above_protection, 0);
  }
}

TEST(InsFault, ForcesAloneAreExcludedIfTheScansConfirmTheRotation) {
  const Seen forces = drive_with(accel_bias({0.0, 0.0, 1.0}), true, 1);
  EXPECT_TRUE(forces.found(Finding::kInsFaulty));
  EXPECT_TRUE(forces.forces_excluded);
  const Seen rates = drive_with(gyro_bias({0.0, 0.0, 2.0}), true, 1);
  EXPECT_TRUE(rates.found(Finding::kInsFaulty));
  EXPECT_FALSE(rates.forces_excluded);
}

TEST(InsFault, NoFaultIsFoundInACleanDrive) {
  const InsFault none{"no fault", [](ImuSample*) {}};
  for (unsigned seed = 1; seed <= 6; ++seed) {
    for (const bool gps_lost : {false, true}) {
      const Seen seen = drive_with(none, gps_lost, seed);
      EXPECT_TRUE(seen.findings.empty()) << "seed " << seed;
      EXPECT_EQ(seen.ins, SourceStatus::kFully) << "seed " << seed;
    }
  }
}

}  // namespace
}  // namespace rcs::wm

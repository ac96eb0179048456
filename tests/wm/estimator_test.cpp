// The estimator on synthetic drives: consistency, each set of sensors, outages, rest.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "modules/wm/alignment.h"
#include "modules/wm/measurement_fusion.h"
#include "tests/support/heap_guard.h"
#include "tests/wm/estimator_rig.h"

namespace rcs::wm {
namespace {

/// Mean over seeds.
double mean_nees(Experiment experiment, unsigned seeds) {
  double sum = 0.0;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    experiment.sensors.seed = seed;
    const Score score = run(experiment);
    EXPECT_TRUE(score.georeferenced);
    sum += score.nees_pose / seeds;
  }
  ::testing::Test::RecordProperty("nees", std::to_string(sum));
  std::printf("mean NEES per degree of freedom over %u seeds: %.2f\n", seeds, sum);
  return sum;
}

TEST(Consistency, AllSources) {
  const double nees = mean_nees({}, 12);
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 1.5);
}

TEST(Consistency, InsAndGps) {
  Experiment experiment;
  experiment.ladar = false;
  const double nees = mean_nees(experiment, 12);
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 1.5);
}

TEST(Consistency, GpsOutage) {
  Experiment experiment;
  experiment.outage_from_s = 30.0;
  experiment.drive.length_s = 90.0;
  const double nees = mean_nees(experiment, 12);
  EXPECT_GT(nees, 0.5);
  EXPECT_LT(nees, 1.5);
}

TEST(Consistency, LadarAndGpsWithoutIns) {
  Experiment experiment;
  experiment.ins = false;
  const double nees = mean_nees(experiment, 12);
  EXPECT_GT(nees, 0.3);  // the second process model is conservative on purpose
  EXPECT_LT(nees, 1.5);
}

TEST(Estimator, LadarAloneGivesOnlyALocalPose) {
  Experiment experiment;
  experiment.ins = experiment.gps = false;
  const Score score = run(experiment);
  EXPECT_FALSE(score.georeferenced);
  EXPECT_EQ(score.mode, Mode::kLadar);
  EXPECT_EQ(score.refused, 0);
}

TEST(Estimator, LadarAndGpsDetermineTheWorldPoseOnceTheVehicleMoves) {
  Experiment experiment;
  experiment.ins = false;
  experiment.drive.still_s = 0.0;
  experiment.drive.length_s = 12.0;  // about the length of the KITTI drive
  experiment.sensors.gps_sigma_m = 0.1;
  const Score score = run(experiment);
  EXPECT_TRUE(score.georeferenced);
  EXPECT_EQ(score.mode, Mode::kGpsLadar);
  EXPECT_LT(score.error_m, 0.5);
  EXPECT_LT(score.heading_error_rad, radians(2.0));
}

TEST(Estimator, RegistrationsBoundTheErrorInAnOutage) {
  Experiment experiment;
  experiment.outage_from_s = 40.0;
  experiment.drive.length_s = 100.0;
  const Score with_ladar = run(experiment);
  experiment.ladar = false;
  const Score alone = run(experiment);
  EXPECT_EQ(with_ladar.mode, Mode::kInsLadar);
  EXPECT_EQ(alone.mode, Mode::kInsDeadReckoning);
  std::printf("60 s without GPS: %.2f m with LADAR (sigma %.2f), %.2f m without (sigma %.2f)\n",
              with_ladar.error_m, with_ladar.sigma_m, alone.error_m, alone.sigma_m);
  EXPECT_LT(with_ladar.error_m, 3.0);
  EXPECT_LT(with_ladar.sigma_m, alone.sigma_m);
  EXPECT_LT(alone.error_m, 4.0 * alone.sigma_m);
}

/// 40 s with GPS, a minute without, no LADAR.
Experiment dead_reckoning() {
  Experiment experiment;
  experiment.ladar = false;
  experiment.outage_from_s = 40.0;
  experiment.drive.length_s = 100.0;
  return experiment;
}

TEST(Estimator, OdometryBoundsDeadReckoning) {
  Experiment experiment = dead_reckoning();
  const Score without = run(experiment);
  experiment.odometry = true;
  const Score with = run(experiment);
  EXPECT_LT(with.sigma_m, without.sigma_m);
  EXPECT_LT(with.error_m, 4.0 * with.sigma_m);
}

TEST(Estimator, TheLateralConstraintBoundsTheErrorWithoutOdometry) {
  Experiment experiment = dead_reckoning();
  const Score held = run(experiment);
  experiment.params.odometry.constrained = false;
  const Score free = run(experiment);
  EXPECT_LT(held.sigma_m, 0.7 * free.sigma_m);
  EXPECT_LT(held.error_m, 4.0 * held.sigma_m);
}

// Too fast uphill and too slow downhill: treated as noise, both appear as a rising vehicle.
TEST(Estimator, WheelSlipUphillDoesNotBiasTheHeight) {
  Experiment experiment = dead_reckoning();
  experiment.odometry = true;
  experiment.sensors.climb_slip = 0.2;
  experiment.params.odometry.slip = 0.005;
  experiment.params.odometry.climb_slip = 0.2;
  double estimated_m2 = 0.0;
  double ignored_m2 = 0.0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    experiment.sensors.seed = seed;
    estimated_m2 += std::pow(run(experiment).height_error_m, 2);
    Experiment ignorant = experiment;
    ignorant.params.odometry.climb_slip = 0.0;
    ignored_m2 += std::pow(run(ignorant).height_error_m, 2);
  }
  std::printf("RMS height error after 60 s: %.2f m, %.2f with slip as noise\n",
              std::sqrt(estimated_m2 / 5.0), std::sqrt(ignored_m2 / 5.0));
  EXPECT_LT(estimated_m2, 0.25 * ignored_m2);
}

/// The yaw rate falls or rises steadily while the INS is silent.
TEST(InsGap, TheRateOfAReturningInsSaysHowTheVehicleHasTurned) {
  const WmParams params;
  const Model model{params};
  for (const double end_radps : {0.0, 0.2, -0.2}) {
    FilterState s{initial_belief(params, from_utime(1'000'000)), {}};
    s.belief.x.inertial = true;
    s.belief.x.v_world = Vec3(10.0, 0.0, 0.0);
    s.belief.P.topLeftCorner<9, 9>() *= 1e-6;
    Innovations records;
    const auto turn = [&](double rate_radps, Duration after) {
      const Stamp now = s.belief.x.stamp + after;
      const Vec3 angle(0.0, 0.0, 0.01 * rate_radps);
      const ImuSample imu{now, Duration(10'000), angle, 0.01 * Vec3(0.0, 0.0, 9.81)};
      advance(model, now, &imu, &s, &records);
    };
    for (int k = 0; k < 500; ++k) turn(0.0, Duration(10'000));
    const double before = log_so3(s.belief.x.T_world_vehicle.q).z();
    const double sigma_before = std::sqrt(s.belief.P(kAttitude + 2, kAttitude + 2));
    constexpr double kGap_s = 0.6;
    turn(end_radps, from_seconds(kGap_s + 0.01));
    const double turned = log_so3(s.belief.x.T_world_vehicle.q).z() - before;
    EXPECT_NEAR(turned, 0.5 * end_radps * kGap_s, 0.015) << end_radps;
    const double sigma = std::sqrt(s.belief.P(kAttitude + 2, kAttitude + 2));
    EXPECT_LT(sigma, 0.06);
    EXPECT_GT(sigma, sigma_before + 0.02);
  }
}

/// A vehicle that stands where every scan is matched to the a priori map.
TEST(Estimator, AtRestTheVarianceOfTheMapErrorDoesNotVanish) {
  WmParams params;
  DriveScript script;
  script.still_s = 1e6;
  script.length_s = 300.0;
  const std::vector<Truth> truth = make_drive(script);
  Sensors sensors(truth, params, {});
  FilterState state;
  state.belief = initial_belief(params, truth[0].stamp);
  state.belief.x.T_world_vehicle = truth[0].T_world_vehicle;
  state.belief.x.inertial = true;
  state.belief = loosen_world(state.belief, Vec3::Constant(10.0), 0.1);
  state.bookkeeping.georeferenced = true;
  state.bookkeeping.ins_stamp = truth[0].stamp;
  History history{Model(params)};
  history.restart(state);
  history.amend(earth_at(test_datum()), [](FilterState*) {});
  std::vector<Innovation> records;
  records.reserve(100000);
  const Vec3 map_bias(0.7, -0.4, 0.3);
  for (std::size_t i = 1; i < truth.size(); ++i) {
    history.insert({truth[i].stamp, sensors.imu(i)});
    if (i % 10 == 0) history.insert({truth[i].stamp, sensors.prior(i, map_bias)});
    history.fuse(&records);
  }
  const Belief& b = history.head().belief;
  const double sigma = std::sqrt(b.P(kPosition, kPosition));
  EXPECT_GT(sigma, 0.9 * params.drive.map_sigma_m * 0.7);
  const Vec3 error = b.x.T_world_vehicle.p - truth.back().T_world_vehicle.p;
  EXPECT_LT(error.norm(), 4.0 * sigma);
}

TEST(Estimator, GoodFixesAreNotRejectedForever) {
  // GIVEN a belief with an error far larger than its sigma
  Experiment experiment;
  experiment.drive.length_s = 90.0;
  Rig rig(experiment);
  auto& [truth, sensors, estimator] = rig;
  const LocalFrame frame(test_datum());
  int refused = 0, accepted_after = 0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    estimator.add(sensors.imu(i));
    const double t = seconds(truth[i].stamp - truth[0].stamp);
    if (i % 10 == 0) estimator.add(truth[i].stamp, sensors.scan(i));
    if (i % 20 == 0) {
      GeodeticFix fix = sensors.gps(i);
      // ... here: all fixes from 30 s on are 30 m to the east of those before.
      const Vec3 p = frame.to_world(fix.antenna) + Vec3(t > 30.0 ? 30.0 : 0.0, 0.0, 0.0);
      fix.antenna = frame.to_geodetic(p);
      estimator.add(truth[i].stamp, fix);
    }
    estimator.fuse();
    for (const Innovation& k : estimator.innovations()) {
      if (k.source != Source::kGpsPosition || t <= 30.0) continue;
      if (k.reason != Reason::kAccepted) ++refused;
      if (k.reason == Reason::kAccepted) ++accepted_after;
    }
    estimator.clear_innovations();
  }
  // THEN they are rejected for a while, then followed in one counted step.
  constexpr double kCauseIsOpen_s = 1.5;  // before they are excluded
  EXPECT_NEAR(refused,
              5.0 * (seconds(experiment.params.fault_detection.persistent) + kCauseIsOpen_s), 15.0);
  EXPECT_GT(accepted_after, 60);
  const FilterState& s = estimator.state();
  EXPECT_NEAR(s.belief.x.T_world_vehicle.p.x() - truth.back().T_world_vehicle.p.x(), 30.0, 3.0);
  EXPECT_GE(s.bookkeeping.world_resets, 2);  // the georeferencing and this one
  EXPECT_GT(s.bookkeeping.last_reset_m, 20.0);
}

TEST(Estimator, TheLocalFrameIsUprightOnASlope) {
  // GIVEN a vehicle at rest with pitch and roll
  const Quat q_world_vehicle = exp_so3(Vec3(0.0, 0.12, 0.0)) * exp_so3(Vec3(-0.08, 0.0, 0.0));
  Estimator estimator(WmParams{}, test_datum());
  const Vec3 force = q_world_vehicle.conjugate() * Vec3(0.0, 0.0, 9.80665);
  for (int i = 1; i <= 1000; ++i) {
    const Duration interval = from_milliseconds(10.0);
    estimator.add(ImuSample{Stamp() + i * interval, interval, Vec3::Zero(), 0.01 * force});
    estimator.fuse();
  }
  // THEN its local pose has the slope's roll and pitch
  ASSERT_TRUE(estimator.started());
  const Vec3 up = estimator.T_local_vehicle().q * (q_world_vehicle.conjugate() * Vec3::UnitZ());
  EXPECT_LT((up - Vec3::UnitZ()).norm(), 2e-3);
}

TEST(Estimator, TheLocalPoseNeverSteps) {
  Rig rig;
  auto& [truth, sensors, estimator] = rig;
  Pose before;
  double largest_m = 0.0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    estimator.add(sensors.imu(i));
    if (i % 10 == 0) estimator.add(truth[i].stamp, sensors.scan(i));
    if (i % 20 == 0) estimator.add(truth[i].stamp, sensors.gps(i));
    estimator.fuse();
    estimator.clear_innovations();
    if (!estimator.started()) continue;
    const Pose step = before.inverse() * estimator.T_local_vehicle();
    const Pose moved = truth[i - 1].T_world_vehicle.inverse() * truth[i].T_world_vehicle;
    largest_m = std::max(largest_m, (step.p - moved.p).norm());
    before = estimator.T_local_vehicle();
  }
  // A centimetre by slewing for 10 ms, and a velocity error of decimetres per second.
  EXPECT_LT(largest_m, 0.02);
}

TEST(Estimator, InANewMapNoVarianceIsNegative) {
  Rig rig;
  auto& [truth, sensors, estimator] = rig;
  for (std::size_t i = 10; i < 2000; i += 130) {
    RollingMatch scan = sensors.scan(i);
    scan.map_epoch = static_cast<std::int32_t>(i);
    scan.seeded = true;
    estimator.add(truth[i].stamp, scan);
    estimator.fuse();
    EXPECT_GE(rolling_pose_covariance(estimator.state().belief).diagonal().minCoeff(), 0.0);
  }
}

// On flat, open ground. The message with which SP began the map came before WM was aligned, or was
// lost.
TEST(Estimator, AMapWhoseScansNeverObserveTheWholePoseIsUsed) {
  for (const std::size_t begins : {std::size_t{0}, std::size_t{600}}) {
    Experiment experiment;
    experiment.gps = false;
    Rig rig(experiment);
    auto& [truth, sensors, estimator] = rig;
    std::int64_t epoch = -1;
    for (std::size_t i = 1; i < 1000; ++i) {
      estimator.add(sensors.imu(i));
      if (i % 10 == 0) {
        RollingMatch scan = sensors.scan(i);
        if (i >= begins) {
          scan.map_epoch += 7;
          scan.seeded = false;
          Vec6 observed;
          observed << 0.0, 0.0, 1.0, 1.0, 1.0, 0.0;  // height, roll, pitch
          scan.information = observed.asDiagonal() * scan.information * observed.asDiagonal();
        }
        epoch = scan.map_epoch;
        estimator.add(truth[i].stamp, scan);
      }
      estimator.fuse();
      estimator.clear_innovations();
    }
    ASSERT_TRUE(estimator.started());
    EXPECT_EQ(estimator.state().belief.x.map_epoch, epoch) << begins;
    EXPECT_GT(estimator.state().bookkeeping.of(Source::kRolling).accepted, truth[900].stamp)
        << begins;
  }
}

// Scan after scan sees the same points, with the same error: each adds what the way since the last
// one is worth.
TEST(Estimator, ScansOfARestingVehicleHardlyCount) {
  Experiment experiment;
  experiment.gps = false;
  experiment.drive.still_s = 20.0;
  Rig rig(experiment);
  auto& [truth, sensors, estimator] = rig;
  double at_rest = 0.0;
  double driving = 0.0;
  for (std::size_t i = 1; i < 3000; ++i) {
    estimator.add(sensors.imu(i));
    if (i % 10 == 0) estimator.add(truth[i].stamp, sensors.scan(i));
    estimator.fuse();
    for (const Innovation& k : estimator.innovations()) {
      if (k.source != Source::kRolling || k.reason != Reason::kAccepted || k.dof == 0) continue;
      const double t = seconds(k.stamp - truth[0].stamp);
      if (t > 15.0 && t < 19.0) at_rest = k.sigma[1];
      if (t > 25.0) driving = k.sigma[1];
    }
    estimator.clear_innovations();
  }
  const double scan_m = experiment.sensors.scan_sigma_m;
  EXPECT_GT(at_rest, 5.0 * scan_m);
  EXPECT_GT(driving, 0.5 * scan_m);
  EXPECT_LT(driving, 3.0 * scan_m);
}

TEST(Estimator, DoesNotAllocateAfterWarmUp) {
  if (!test::HeapGuard::available()) GTEST_SKIP() << "a sanitizer owns malloc";
  Rig rig;
  auto& [truth, sensors, estimator] = rig;
  std::int64_t allocations = 0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const ImuSample imu = sensors.imu(i);
    const GeodeticFix fix = sensors.gps(i);
    const RollingMatch scan = sensors.scan(i);
    const OdometrySample odometry = sensors.odometry(i);
    const test::HeapGuard guard;
    estimator.add(imu);
    if (i % 20 == 0) estimator.add(truth[i].stamp, fix);
    if (i % 10 == 0) estimator.add(truth[i].stamp, scan);
    if (i % 5 == 0) estimator.add(truth[i].stamp, odometry);
    estimator.fuse();
    estimator.clear_innovations();
    if (i > 100) allocations += guard.allocations();
  }
  EXPECT_TRUE(estimator.state().bookkeeping.georeferenced);
  EXPECT_EQ(allocations, 0);
}

}  // namespace
}  // namespace rcs::wm

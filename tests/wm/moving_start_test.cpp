// Starts of the estimator while the vehicle moves.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tests/wm/estimator_rig.h"

namespace rcs::wm {
namespace {

/// @param speed_mps  from the first sample on
Experiment moving(double speed_mps, double gps_sigma_m) {
  Experiment e;
  e.ladar = false;
  e.drive.still_s = -20.0;
  e.drive.length_s = 40.0;
  e.drive.speed_mps = speed_mps;
  e.sensors.gps_sigma_m = gps_sigma_m;
  return e;
}

/// @param within_s  after the levelling, which takes 10 s in motion
void expect_aligned(Experiment e, double within_s) {
  constexpr unsigned kSeeds = 20;
  double nees = 0.0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    e.sensors.seed = seed;
    e.drive.heading_rad = 0.3 * seed;
    const Score score = run(e);
    EXPECT_TRUE(score.georeferenced) << seed;
    EXPECT_LT(score.georeferenced_s, 10.0 + within_s) << seed;
    EXPECT_LT(score.worst_error_m, 2.0) << seed;
    EXPECT_LT(score.heading_error_rad, radians(1.0)) << seed;
    nees += score.nees_pose / kSeeds;
  }
  EXPECT_LT(nees, 2.5);
  std::printf("mean NEES per degree of freedom %.2f\n", nees);
}

TEST(MovingStart, ACarFindsItsHeadingByPositions) { expect_aligned(moving(8.0, 0.3), 2.0); }

TEST(MovingStart, AHandCarriedInsFindsItsHeadingByItsTurns) {
  Experiment e = moving(1.4, 0.05);
  e.params.odometry.constrained = false;
  expect_aligned(e, 20.0);
}

TEST(MovingStart, LadarAndPositions) {
  Experiment e = moving(5.0, 0.3);
  e.ladar = true;
  expect_aligned(e, 3.0);
}

// Its course is not its heading: only turns and changes of the speed show it.
TEST(MovingStart, AVehicleThatMovesObliquelyFindsItsHeadingByItsTurns) {
  constexpr double kOblique_rad = 1.0;
  Experiment e = moving(5.0, 0.05);
  e.params.odometry.constrained = false;
  Rig rig(e);
  auto& [truth, sensors, estimator] = rig;
  const Quat q_path_vehicle(Eigen::AngleAxisd(kOblique_rad, Vec3::UnitZ()));
  double error_rad = 0.0;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    ImuSample imu = sensors.imu(i);
    imu.delta_angle = q_path_vehicle.conjugate() * imu.delta_angle;
    imu.delta_v = q_path_vehicle.conjugate() * imu.delta_v;
    estimator.add(imu);
    if (i % 20 == 0) {
      GeodeticFix fix = sensors.gps(i);
      fix.fix.has_velocity = true;
      fix.fix.v_world = truth[i].v_world;
      fix.fix.sigma_v_mps = Vec3::Constant(0.05);
      estimator.add(truth[i].stamp, fix);
    }
    estimator.fuse();
    estimator.clear_innovations();
    if (!estimator.started() || !estimator.state().bookkeeping.georeferenced) continue;
    const Quat q = truth[i].T_world_vehicle.q * q_path_vehicle;
    const double yaw_rad = yaw_of(estimator.state().belief.x.T_world_vehicle.q);
    error_rad = std::max(error_rad, std::abs(wrap_angle(yaw_rad - yaw_of(q))));
  }
  EXPECT_TRUE(estimator.state().bookkeeping.georeferenced);
  EXPECT_LT(error_rad, radians(10.0));
}

// A velocity of zero has no direction: of a vehicle that stands while GPS reports a velocity, or
// whose wheels are stuck.
TEST(MovingStart, ACourseIsNoHeadingOfAVehicleThatDoesNotMove) {
  Experiment e;
  e.drive.still_s = 10.0;
  e.drive.length_s = 40.0;
  Rig rig(e);
  auto& [truth, sensors, estimator] = rig;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const double t = seconds(truth[i].stamp - truth[0].stamp);
    estimator.add(sensors.imu(i));
    if (i % 5 == 0) estimator.add(truth[i].stamp, sensors.odometry(i));
    if (i % 20 == 0) {
      GeodeticFix fix = sensors.gps(i);
      if (t < 8.0) {
        fix.fix.has_velocity = true;
        fix.fix.v_world = Vec3(4.0, 0.0, 0.0);
        fix.fix.sigma_v_mps = Vec3::Constant(0.05);
      }
      estimator.add(truth[i].stamp, fix);
    }
    estimator.fuse();
    estimator.clear_innovations();
    if (t < 9.5 && estimator.started()) {
      EXPECT_FALSE(estimator.state().bookkeeping.georeferenced) << t;
    }
  }
  const Pose& here = estimator.state().belief.x.T_world_vehicle;
  EXPECT_TRUE(estimator.state().bookkeeping.georeferenced);
  EXPECT_LT((here.p - truth.back().T_world_vehicle.p).head<2>().norm(), 2.0);
}

}  // namespace
}  // namespace rcs::wm

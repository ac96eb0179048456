// A solution that is lost is discarded, and begins again from the sources.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "modules/wm/loss_watch.h"
#include "tests/wm/estimator_rig.h"

namespace rcs::wm {
namespace {

Stamp at_s(double s) { return Stamp(from_seconds(s)); }

TEST(LossWatch, AnImpossibleVelocityThatLastsIsALoss) {
  for (const Vec3& v : {Vec3(3.0, 6.0, 0.0), Vec3(0.0, 0.0, -7.0), Vec3(90.0, 0.0, 0.0),
                        Vec3(std::numeric_limits<double>::quiet_NaN(), 0.0, 0.0)}) {
    LossWatch watch;
    EXPECT_FALSE(watch.add(at_s(10.0), v, true)) << v.transpose();
    EXPECT_FALSE(watch.add(at_s(11.9), v, true)) << v.transpose();
    EXPECT_TRUE(watch.add(at_s(12.1), v, true)) << v.transpose();
  }
}

TEST(LossWatch, ASlideAFallAndAFastDriveAreNone) {
  LossWatch watch;
  for (int k = 0; k < 100; ++k) {
    const Vec3 slide(10.0, k % 20 < 15 ? 7.0 : 1.0, 0.0);
    EXPECT_FALSE(watch.add(at_s(0.1 * k), slide, true));
  }
  for (int k = 100; k < 200; ++k) {
    EXPECT_FALSE(watch.add(at_s(0.1 * k), Vec3(50.0, 2.0, 1.0), true));
  }
  for (int k = 200; k < 300; ++k) {  // carried by hand or on water: any direction
    EXPECT_FALSE(watch.add(at_s(0.1 * k), Vec3(1.0, 8.0, 0.0), false));
  }
}

/// The gyro rolls the attitude on its side while nothing else is received. @return error at the end
TEST(EstimatorLoss, AWrongAttitudeIsFoundAndTheFilterBeginsAgain) {
  Experiment experiment;
  experiment.drive.length_s = 90.0;
  Rig rig(experiment);
  auto& [truth, sensors, estimator] = rig;
  double end_m = 0.0;
  double worst_local_m = 0.0;
  Pose local_before;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    const Stamp now = truth[i].stamp;
    const double t = seconds(now - truth[0].stamp);
    const bool alone = t > 30.0 && t < 50.0;
    ImuSample imu = sensors.imu(i);
    if (t > 30.0 && t < 33.0) imu.delta_angle.x() += 0.4 * seconds(imu.interval);
    estimator.add(imu);
    const RollingMatch match = sensors.scan(i);
    const GeodeticFix fix = sensors.gps(i);
    const OdometrySample wheels = sensors.odometry(i);
    if (!alone && i % 5 == 0) estimator.add(now, wheels);
    if (!alone && i % 10 == 0) estimator.add(now, match);
    if (!alone && i % 20 == 0) estimator.add(now, fix);
    estimator.fuse();
    estimator.clear_innovations();
    if (!estimator.started()) continue;
    if (t > 40.0) {
      const Pose step = local_before.inverse() * estimator.T_local_vehicle();
      worst_local_m = std::max(worst_local_m, step.p.norm());
    }
    local_before = estimator.T_local_vehicle();
    const Pose& T = estimator.state().belief.x.T_world_vehicle;
    end_m = (T.p - truth[i].T_world_vehicle.p).norm();
  }
  EXPECT_GE(estimator.losses(), 1);
  EXPECT_LE(estimator.losses(), 3);
  ASSERT_TRUE(estimator.state().bookkeeping.georeferenced);
  EXPECT_LT(end_m, 2.0);
  EXPECT_LT(worst_local_m, 0.2) << "per sample";
}

}  // namespace
}  // namespace rcs::wm

// The estimator under clock errors: of one source, of all, before the start and after it.
#include <gtest/gtest.h>

#include <chrono>

#include "tests/wm/estimator_rig.h"

namespace rcs::wm {
namespace {

ImuSample later(ImuSample imu, Duration by) {
  imu.stamp += by;
  return imu;
}

TEST(EstimatorClock, ACommonClockStepIsFollowed) {
  for (const double step_s : {+40.0, -40.0}) {
    Experiment experiment;
    experiment.drive.length_s = 40.0;
    Rig rig(experiment);
    auto& [truth, sensors, estimator] = rig;
    for (std::size_t i = 1; i < truth.size(); ++i) {
      const Duration shift = i > 2000 ? from_seconds(step_s) : Duration::zero();
      estimator.add(later(sensors.imu(i), shift));
      if (i % 10 == 0) estimator.add(truth[i].stamp + shift, sensors.scan(i));
      if (i % 20 == 0) estimator.add(truth[i].stamp + shift, sensors.gps(i));
      estimator.fuse();
      estimator.clear_innovations();
    }
    EXPECT_EQ(estimator.clock_steps(), 1);
    EXPECT_EQ(estimator.mode(), Mode::kGpsInsLadar);
    EXPECT_EQ(estimator.state().belief.x.stamp, truth.back().stamp + from_seconds(step_s));
    EXPECT_LT(
        (estimator.state().belief.x.T_world_vehicle.p - truth.back().T_world_vehicle.p).norm(),
        2.0);
  }
}

TEST(EstimatorClock, OneStampFromTheFutureIsRejected) {
  Experiment experiment;
  experiment.drive.length_s = 10.0;
  Rig rig(experiment);
  auto& [truth, sensors, estimator] = rig;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    estimator.add(sensors.imu(i));
    if (i == 700) {
      EXPECT_EQ(estimator.add(later(sensors.imu(i), std::chrono::hours(1))), Reason::kInvalid);
    }
    estimator.fuse();
  }
  EXPECT_EQ(estimator.state().belief.x.stamp, truth.back().stamp);
  EXPECT_EQ(estimator.clock_steps(), 0);
}

TEST(EstimatorClock, OneStampFromTheFutureBeforeTheStartDelaysItByLittle) {
  Rig rig;
  auto& [truth, sensors, estimator] = rig;
  estimator.add(later(sensors.imu(1), std::chrono::hours(1000)));
  for (std::size_t i = 2; i < truth.size(); ++i) {
    estimator.add(sensors.imu(i));
    estimator.fuse();
  }
  ASSERT_TRUE(estimator.started());
  EXPECT_EQ(estimator.state().belief.x.stamp, truth.back().stamp);
}

TEST(EstimatorClock, OneInsStampFromTheFutureDoesNotDelayTheLadar) {
  Rig rig;
  auto& [truth, sensors, estimator] = rig;
  estimator.add(later(sensors.imu(1), std::chrono::hours(1000)));
  EXPECT_EQ(estimator.add(truth[10].stamp, sensors.scan(10)), Reason::kAccepted);
}

// The shift is part of what a successor continues with: its stamps alone do not show it.
TEST(EstimatorClock, ASuccessorKnowsTheShiftOfTheInsClock) {
  for (const double step_s : {0.2, 3.0, -0.2}) {
    Experiment experiment;
    experiment.drive.length_s = 40.0;
    Rig rig(experiment);
    auto& [truth, sensors, first] = rig;
    Estimator second(experiment.params, test_datum());
    double worst_m = 0.0;
    for (std::size_t i = 1; i < truth.size(); ++i) {
      const Stamp now = truth[i].stamp;
      const Duration shift = i > 1000 ? from_seconds(step_s) : Duration::zero();
      if (i == 2000) second.resume(first.continuation());
      Estimator& estimator = i < 2000 ? first : second;
      estimator.add(later(sensors.imu(i), shift), now);
      if (i % 5 == 0) estimator.add(now, sensors.odometry(i), now);
      if (i % 10 == 0) estimator.add(now, sensors.scan(i), now);
      if (i % 20 == 0) estimator.add(now, sensors.gps(i), now);
      estimator.watch_clocks(now);
      estimator.fuse();
      estimator.clear_innovations();
      if (i < 2000) continue;
      const Pose& here = estimator.state().belief.x.T_world_vehicle;
      worst_m = std::max(worst_m, (here.p - truth[i].T_world_vehicle.p).head<2>().norm());
    }
    EXPECT_NEAR(seconds(second.ins_clock_shift()), -step_s, 1e-3);
    EXPECT_EQ(second.clock_steps(), 0) << step_s;
    EXPECT_EQ(second.mode(), Mode::kGpsInsLadar) << step_s;
    EXPECT_LT(worst_m, 1.0) << step_s;
  }
}

}  // namespace
}  // namespace rcs::wm

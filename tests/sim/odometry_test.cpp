#include "sim/sensors/odometry.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

TEST(Odometry, WithoutErrorsItIsTheMeanMotion) {
  const Course course(s_course());
  const World world(flat_world(), {}, course.points(), 20.0);
  const Trajectory vehicle = drive(course, world, {}, course.duration_s());
  OdometryParams params;
  params.scale_error = params.slip_per_grade = 0.0;
  params.sigma_speed_mps = params.sigma_yaw_rate_radps = 0.0;
  WheelOdometer odometer(params, 1);
  double way_m = 0.0;
  double turn_rad = 0.0;
  const int n = static_cast<int>(course.duration_s() / 0.05);
  for (int k = 1; k <= n; ++k) {
    const WheelMotion m = odometer.measure(vehicle, 0.05 * k);
    way_m += 0.05 * m.speed_mps;
    turn_rad += 0.05 * m.yaw_rate_radps;
  }
  EXPECT_NEAR(way_m, course.length_m(), 0.1);
  EXPECT_NEAR(turn_rad, yaw_of(vehicle.pose_at(0.05 * n).q) - yaw_of(vehicle.pose_at(0.0).q), 1e-3);
}

TEST(Odometry, WheelsTurnTooFastUphill) {
  const Course course(s_course());
  const World world(bare_hills(), {}, course.points(), 20.0);
  const Trajectory vehicle = drive(course, world, {}, course.duration_s());
  OdometryParams params;
  params.scale_error = 0.0;
  params.slip_per_grade = 0.5;
  params.sigma_speed_mps = params.sigma_yaw_rate_radps = 0.0;
  WheelOdometer odometer(params, 1);
  for (int k = 1; k <= 300; ++k) {
    const double end_s = 0.05 * k;
    const double speed = odometer.measure(vehicle, end_s).speed_mps;
    const Motion m = vehicle.at(end_s - 0.025);
    const Vec3 ahead = m.T_world_vehicle.q * Vec3::UnitX();
    const double truth = ahead.dot(m.v_world);
    if (truth < 2.0) continue;
    EXPECT_NEAR(speed / truth - 1.0, 0.5 * ahead.z(), 0.01) << end_s;
  }
}

TEST(Odometry, StandsStillWithoutNoise) {
  const Course course(s_course());
  const World world(flat_world(), {}, course.points(), 20.0);
  const Trajectory vehicle = drive(course, world, {}, 2.0);
  WheelOdometer odometer({}, 1);
  EXPECT_EQ(odometer.measure(vehicle, 1.0).speed_mps, 0.0);
}

}  // namespace
}  // namespace rcs::sim

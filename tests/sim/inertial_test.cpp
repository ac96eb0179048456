#include "sim/sensors/inertial.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

const Geodetic kPlace{radians(40.43), radians(-76.57), {150.0}};

InertialParams perfect() {
  InertialParams p;
  p.scale_error = 0.0;
  p.misalignment_rad = 0.0;
  return p;
}

TEST(Inertial, AtRestMeasuresGravityAndEarthRate) {
  const Course course(s_course());
  const World world(flat_world(), {}, course.points(), 20.0);
  const Trajectory vehicle = drive(course, world, {}, 2.0);
  InertialSensor sensor(perfect(), Planet::at(kPlace), 1);
  const InertialIncrement inc = sensor.measure(vehicle, 0.5);
  EXPECT_NEAR(inc.delta_v.z() / 0.01, normal_gravity(kPlace.lat_rad, kPlace.height), 1e-9);
  EXPECT_NEAR(inc.delta_v.head<2>().norm(), 0.0, 1e-12);
  const Vec3 rate_vehicle = vehicle.pose_at(0.5).q.conjugate() * earth_rate_world(kPlace.lat_rad);
  EXPECT_LT((inc.delta_angle / 0.01 - rate_vehicle).norm(), 1e-12);
}

// Strapdown navigation with the increments alone, from the true start, over rough ground. The
// two-sample coning and sculling terms (Savage 1998) are needed because the increments are plain
// integrals in the turning frame.
TEST(Inertial, PerfectIncrementsIntegrateToTheTruth) {
  const Course course(s_course());
  const World world(bare_hills(), {}, course.points(), 20.0);
  const Trajectory vehicle = drive(course, world, {}, 25.0);
  const Planet planet = Planet::at(kPlace);
  InertialSensor sensor(perfect(), planet, 1);
  const double dt = 0.01;

  Motion start = vehicle.at(0.0);
  Quat q = start.T_world_vehicle.q;
  Vec3 v = start.v_world;
  Vec3 p = start.T_world_vehicle.p;
  InertialIncrement last;
  double worst_m = 0.0;
  double worst_rad = 0.0;
  for (int k = 1; k <= 2000; ++k) {
    const InertialIncrement inc = sensor.measure(vehicle, k * dt);
    const Vec3 coning = last.delta_angle.cross(inc.delta_angle) / 12.0;
    const Vec3 sculling =
        (last.delta_angle.cross(inc.delta_v) + last.delta_v.cross(inc.delta_angle)) / 12.0;
    const Vec3 rotation = inc.delta_angle + coning;
    // Velocity in the frame at the interval's start.
    const Vec3 dv = inc.delta_v + 0.5 * inc.delta_angle.cross(inc.delta_v) + sculling;
    const Vec3 v_old = v;
    const Quat q_earth = exp_so3(-planet.rate_world * dt);  // frame world turns below the vehicle
    v += q * dv + dt * (Vec3(0, 0, -planet.gravity_mps2) - 2.0 * planet.rate_world.cross(v_old));
    p += 0.5 * dt * (v_old + v);
    q = (q_earth * q * exp_so3(rotation)).normalized();
    last = inc;
    const Motion truth = vehicle.at(k * dt);
    worst_m = std::max(worst_m, (p - truth.T_world_vehicle.p).norm());
    worst_rad = std::max(worst_rad, log_so3(truth.T_world_vehicle.q.conjugate() * q).norm());
  }
  EXPECT_LT(worst_m, 0.03);
  EXPECT_LT(worst_rad, radians(0.01));
}

TEST(Inertial, ErrorsHaveTheGradesSize) {
  const Course course(s_course());
  const World world(flat_world(), {}, course.points(), 20.0);
  const Trajectory vehicle = drive(course, world, {}, 2.0);  // at rest: clamped after its end
  InertialParams params = perfect();
  params.grade.gyro_bias_radps = 1e-3;
  params.grade.accel_bias_mps2 = 0.02;
  params.grade.gyro_walk_radprs = 1e-4;
  params.grade.accel_walk_mpsrs = 1e-3;
  double bias2 = 0.0, walk2 = 0.0, accel_bias2 = 0.0, accel_walk2 = 0.0;
  const int seeds = 60;
  const int n = 500;
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    InertialSensor noisy(params, Planet{}, seed);
    Vec3 sum = Vec3::Zero(), squares = Vec3::Zero(), dv_sum = Vec3::Zero(),
         dv_squares = Vec3::Zero();
    for (int k = 1; k <= n; ++k) {
      const InertialIncrement inc = noisy.measure(vehicle, 0.01 * k);
      sum += inc.delta_angle;
      squares += inc.delta_angle.cwiseAbs2();
      dv_sum += inc.delta_v;
      dv_squares += inc.delta_v.cwiseAbs2();
    }
    bias2 += (sum / (0.01 * n)).squaredNorm() / 3;
    accel_bias2 += (dv_sum / (0.01 * n)).squaredNorm() / 3;
    walk2 += (squares / n - (sum / n).cwiseAbs2()).sum() / 3;
    accel_walk2 += (dv_squares / n - (dv_sum / n).cwiseAbs2()).sum() / 3;
  }
  EXPECT_NEAR(std::sqrt(bias2 / seeds), 1e-3, 1.5e-4);  // 180 samples: 5 %, three sigma
  EXPECT_NEAR(std::sqrt(accel_bias2 / seeds), 0.02, 3e-3);
  EXPECT_NEAR(std::sqrt(walk2 / seeds), 1e-4 * 0.1, 2e-7);  // per interval: root of 0.01 s
  EXPECT_NEAR(std::sqrt(accel_walk2 / seeds), 1e-3 * 0.1, 2e-6);
}

}  // namespace
}  // namespace rcs::sim

#include "modules/sp/scan/scan_motion.h"

#include <gtest/gtest.h>

#include <random>

namespace rcs::sp {
namespace {

constexpr Duration kStep = from_milliseconds(10.0);

MotionState start() {
  MotionState s;
  s.stamp = from_utime(1'000'000);
  s.T_rolling_vehicle = {exp_so3(Vec3(0.05, -0.1, 1.0)), Vec3(1.0, 2.0, 3.0)};
  s.v_rolling = Vec3(5.0, 7.0, 0.5);
  s.gyro_bias_radps = Vec3(1e-3, -2e-3, 5e-4);
  s.accel_bias_mps2 = Vec3(0.01, 0.02, -0.03);
  s.rate_vehicle_radps = Vec3(0.01, -0.02, 0.2);
  return s;
}

InertialBuffer shaky(int n) {
  std::mt19937 rng(5);
  std::normal_distribution<double> noise;
  InertialBuffer buffer(64);
  for (int i = 1; i <= n; ++i) {
    InertialSample s;
    s.stamp = from_utime(1'000'000) + i * kStep;
    s.interval = kStep;
    s.delta_angle_rad = 0.003 * Vec3(noise(rng), noise(rng), noise(rng));
    s.delta_v_mps = Vec3(0.02 * noise(rng), 0.02 * noise(rng), 0.098);
    EXPECT_TRUE(buffer.add(s));
  }
  return buffer;
}

TEST(Motion, BackwardUndoesForward) {
  const InertialBuffer inertial = shaky(30);
  const MotionState s = start();
  for (const double dt_ms : {5.0, 10.0, 33.3, 200.0, 300.0, 350.0}) {
    const MotionState there = propagate(s, inertial, s.stamp + from_milliseconds(dt_ms));
    const MotionState back = propagate(there, inertial, s.stamp);
    EXPECT_LT((back.T_rolling_vehicle.p - s.T_rolling_vehicle.p).norm(), 1e-9) << dt_ms;
    EXPECT_LT((back.v_rolling - s.v_rolling).norm(), 1e-9) << dt_ms;
    EXPECT_LT(log_so3(back.T_rolling_vehicle.q.conjugate() * s.T_rolling_vehicle.q).norm(), 1e-9);
  }
}

TEST(Motion, FreeFallIsAParabola) {
  MotionState s;
  s.v_rolling = Vec3(3.0, 0.0, 0.0);
  InertialBuffer inertial(256);
  for (int i = 1; i <= 100; ++i) {
    inertial.add({Stamp() + i * kStep, kStep, Vec3::Zero(), Vec3::Zero()});
  }
  const MotionState end = propagate(s, inertial, Stamp() + 100 * kStep);
  EXPECT_NEAR(end.T_rolling_vehicle.p.x(), 3.0, 1e-9);
  EXPECT_NEAR(end.T_rolling_vehicle.p.z(), -0.5 * 9.80665, 1e-9);
  EXPECT_NEAR(end.v_rolling.z(), -9.80665, 1e-9);
}

TEST(Motion, WithoutSamplesTheLastTurnRateContinues) {
  // A circle of 10 m at 5 m/s: half a turn ends on the other side.
  MotionState s;
  s.v_rolling = Vec3(5.0, 0.0, 0.0);
  s.rate_vehicle_radps = Vec3(0.0, 0.0, 0.5);
  const MotionState end = coast(s, Stamp() + from_seconds(kPi / 0.5));
  EXPECT_LT((end.T_rolling_vehicle.p - Vec3(0.0, 20.0, 0.0)).norm(), 1e-4);
  EXPECT_LT((end.v_rolling - Vec3(-5.0, 0.0, 0.0)).norm(), 1e-4);
}

TEST(Motion, BackwardSamplesAreRejectedAndTheOldestRemoved) {
  InertialBuffer buffer(3);
  for (int i = 1; i <= 5; ++i) {
    EXPECT_TRUE(buffer.add({Stamp() + i * kStep, kStep, Vec3::Zero(), Vec3::Zero()}));
  }
  EXPECT_FALSE(buffer.add({Stamp() + 5 * kStep, kStep, Vec3::Zero(), Vec3::Zero()}));
  EXPECT_FALSE(buffer.add({Stamp() + 2 * kStep, kStep, Vec3::Zero(), Vec3::Zero()}));
  ASSERT_EQ(buffer.size(), 3U);
  EXPECT_EQ(buffer[0].stamp, Stamp() + 3 * kStep);
}

TEST(Motion, DiscardedSamplesAreTheNewest) {
  InertialBuffer buffer(4);
  for (int i = 1; i <= 6; ++i) {
    EXPECT_TRUE(buffer.add({Stamp() + i * kStep, kStep, Vec3::Zero(), Vec3::Zero()}));
  }
  buffer.discard(Stamp() + 5 * kStep, Stamp() + 7 * kStep);
  ASSERT_EQ(buffer.size(), 2U);
  EXPECT_EQ(buffer[1].stamp, Stamp() + 4 * kStep);
  EXPECT_TRUE(buffer.add({Stamp() + 7 * kStep, kStep, Vec3::Zero(), Vec3::Zero()}));
  EXPECT_EQ(buffer[2].stamp, Stamp() + 7 * kStep);
  buffer.discard(Stamp(), Stamp() + 4 * kStep);
  EXPECT_EQ(buffer.size(), 3U) << "of a late sample";
}

TEST(Motion, OneSampleFromTheFutureDoesNotBlockLaterSamples) {
  InertialBuffer buffer(100);
  EXPECT_TRUE(buffer.add({Stamp() + from_seconds(1e6), kStep, Vec3::Zero(), Vec3::Zero()}));
  for (int i = 1; i < InertialBuffer::kClockStepped; ++i) {
    EXPECT_FALSE(buffer.add({Stamp() + i * kStep, kStep, Vec3::Zero(), Vec3::Zero()}));
  }
  const Stamp now = Stamp() + InertialBuffer::kClockStepped * kStep;
  EXPECT_TRUE(buffer.add({now, kStep, Vec3::Zero(), Vec3::Zero()}));
  ASSERT_EQ(buffer.size(), 1U);
  EXPECT_EQ(buffer[0].stamp, now);
}

TEST(Motion, TableIsIdentityAtTheReference) {
  const InertialBuffer inertial = shaky(30);
  MotionTable table;
  const Stamp reference = start().stamp + from_milliseconds(100.0);
  tabulate_motion(start(), inertial, reference, from_milliseconds(-50.0), from_milliseconds(50.0),
                  &table);
  const MotionState at_reference = propagate(start(), inertial, reference);
  for (std::size_t k = 0; k < table.T_reference_vehicle.size(); ++k) {
    const Stamp t = reference + table.first + static_cast<int>(k) * table.step;
    const MotionState at = propagate(start(), inertial, t);
    const Pose expected = at_reference.T_rolling_vehicle.inverse() * at.T_rolling_vehicle;
    // The two paths cut the samples' intervals at different times: micrometres.
    EXPECT_LT((table.T_reference_vehicle[k].p - expected.p).norm(), 1e-5);
  }
}

}  // namespace
}  // namespace rcs::sp

// Prediction of the pose at a scan.
#include "modules/sp/motion_prediction.h"

#include <gtest/gtest.h>

namespace rcs::sp {
namespace {

Stamp at(double t_s) { return Stamp() + from_seconds(t_s); }
Pose along(double x_m) { return {Quat::Identity(), Vec3(x_m, 0.0, 0.0)}; }

InertialBuffer at_rest(double until_s) {
  InertialBuffer inertial(256);
  for (double t_s = 0.01; t_s < until_s; t_s += 0.01) {
    EXPECT_TRUE(inertial.add(
        {at(t_s), from_milliseconds(10.0), Vec3::Zero(), Vec3(0.0, 0.0, 9.80665 * 0.01)}));
  }
  return inertial;
}

MotionState moving(double t_s, double x_m, double speed_mps) {
  MotionState s;
  s.stamp = at(t_s);
  s.T_rolling_vehicle = along(x_m);
  s.v_rolling = Vec3(speed_mps, 0.0, 0.0);
  return s;
}

TEST(MotionPrediction, IsUnknownAtTheStart) {
  const MotionGuess guess;
  const Expectation e = guess.expect(at(1.0), InertialBuffer(8), {});
  EXPECT_TRUE(e.at_reference.T_rolling_vehicle.p.isZero());
  EXPECT_EQ(e.covariance(0, 0), 0.25);
}

TEST(MotionPrediction, ABeliefIsPropagatedByTheIns) {
  MotionGuess guess;
  guess.believe(moving(1.0, 5.0, 8.0), isotropic(0.02, 0.001));
  guess.remember(at(0.9), along(100.0));  // not used while there is a belief
  const Expectation e = guess.expect(at(1.1), at_rest(1.2), {});
  EXPECT_NEAR(e.at_reference.T_rolling_vehicle.p.x(), 5.8, 1e-6);
  EXPECT_NEAR(e.covariance(0, 0), 0.02 * 0.02 + 0.02 * 0.02, 1e-9);
  // Twice the sigma when so configured.
  ExpectationParams wary;
  wary.sigma_scale = 2.0;
  EXPECT_NEAR(guess.expect(at(1.1), at_rest(1.2), wary).covariance(0, 0), 4.0 * e.covariance(0, 0),
              1e-9);
}

TEST(MotionPrediction, WithoutInsOrBeliefTheLastMotionIsExtrapolated) {
  MotionGuess guess;
  guess.remember(at(1.0), along(10.0));
  guess.remember(at(1.1), along(11.0));
  EXPECT_NEAR(guess.expect(at(1.2), InertialBuffer(8), {}).at_reference.T_rolling_vehicle.p.x(),
              12.0, 1e-6);
  // A belief is not used if the INS samples do not extend to it or if it belongs to another time.
  guess.believe(moving(1.1, 500.0, 0.0), isotropic(0.02, 0.001));
  EXPECT_LT(guess.expect(at(1.2), InertialBuffer(8), {}).at_reference.T_rolling_vehicle.p.x(), 20);
  guess.believe(moving(100.0, 500.0, 0.0), isotropic(0.02, 0.001));
  EXPECT_LT(guess.expect(at(1.2), at_rest(1.3), {}).at_reference.T_rolling_vehicle.p.x(), 20);
}

TEST(MotionPrediction, ASilentInsIsReportedLost) {
  const MotionGuess guess;
  const InertialBuffer inertial = at_rest(1.0);  // newest at 0.99 s
  EXPECT_FALSE(guess.expect(at(1.04), inertial, {}).ins_lost);
  EXPECT_TRUE(guess.expect(at(1.06), inertial, {}).ins_lost);
  EXPECT_TRUE(guess.expect(at(60.0), inertial, {}).ins_lost);
  EXPECT_TRUE(guess.expect(at(60.0), inertial, {}).ins_silent());
  EXPECT_FALSE(guess.expect(at(1.0), InertialBuffer(8), {}).ins_lost);
  InertialBuffer gap = at_rest(1.0);
  for (double t_s = 1.31; t_s < 2.5; t_s += 0.01) {
    EXPECT_TRUE(gap.add({at(t_s), from_milliseconds(10.0), Vec3::Zero(), Vec3::Zero()}));
    EXPECT_EQ(guess.expect(at(t_s), gap, {}).ins_lost, t_s < 1.815) << t_s;
    EXPECT_FALSE(guess.expect(at(t_s), gap, {}).ins_silent());
  }
  InertialBuffer slow(8);
  EXPECT_TRUE(slow.add({at(1.0), from_milliseconds(100.0), Vec3::Zero(), Vec3::Zero()}));
  EXPECT_FALSE(guess.expect(at(1.25), slow, {}).ins_lost);
  EXPECT_TRUE(guess.expect(at(1.35), slow, {}).ins_lost);
}

TEST(MotionPrediction, TheMotionOfAScanLeadsFromTheLastPoseToItsOwn) {
  MotionGuess guess;
  EXPECT_FALSE(guess.motion_to(at(1.1), along(1.0)));
  guess.remember(at(1.0), along(10.0));
  const Pose turned{exp_so3(Vec3(0.0, 0.1, 0.0)), Vec3(10.5, 0.0, -0.1)};
  const std::optional<MotionState> motion = guess.motion_to(at(1.1), turned);
  ASSERT_TRUE(motion);
  EXPECT_NEAR(motion->rate_vehicle_radps.y(), 1.0, 1e-9);
  const MotionState back = coast(*motion, at(1.0));
  EXPECT_LT((back.T_rolling_vehicle.p - Vec3(10.0, 0.0, 0.0)).norm(), 1e-9);
  EXPECT_LT(log_so3(back.T_rolling_vehicle.q).norm(), 1e-9);
  EXPECT_FALSE(guess.motion_to(at(1.6), turned)) << "the last pose is too old";
  EXPECT_FALSE(guess.motion_to(at(1.0), turned));
  EXPECT_FALSE(guess.motion_to(at(1.001), along(11.0))) << "1000 m/s";
}

TEST(MotionPrediction, APoseThatImpliesImplausibleMotionIsIgnored) {
  MotionGuess guess;
  guess.remember(at(1.0), along(10.0));
  guess.remember(at(1.001), along(11.0));  // 1000 m/s
  EXPECT_EQ(guess.expect(at(1.1), InertialBuffer(8), {}).at_reference.T_rolling_vehicle.p.x(),
            11.0);
  guess.remember(at(0.5), along(12.0));  // the clock stepped back
  EXPECT_EQ(guess.expect(at(0.6), InertialBuffer(8), {}).at_reference.T_rolling_vehicle.p.x(),
            12.0);
  guess.forget_poses();
  EXPECT_EQ(guess.expect(at(0.6), InertialBuffer(8), {}).at_reference.T_rolling_vehicle.p.x(), 0.0);
}

}  // namespace
}  // namespace rcs::sp

// Between INS and LADAR the wheels decide, and the errors of a poor LADAR are measured.
#include "modules/wm/fault_detection/motion_votes.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rcs::wm {
namespace {

/// A straight drive of 10 s at 10 m/s, registered ten times a second.
MotionVotes drive(double ins_factor, double ladar_factor, double wheels_factor) {
  MotionVotes votes;
  const Mat6 covariance = 1e-4 * Mat6::Identity();
  for (int k = 0; k <= 200; ++k) {
    const Stamp t = Stamp() + from_milliseconds(50.0 * k);
    const double x_m = 0.5 * k;
    votes.add(t, OdometrySample{10.0 * wheels_factor, 0.05, 0.0, 0.02}, 1.0, true);
    if (k % 2 != 0) continue;
    RollingMatch z;
    z.T_rolling_vehicle.p.x() = ladar_factor * x_m;
    Pose by_ins;
    by_ins.p.x() = ins_factor * x_m;
    votes.add(t, z, covariance, DriveNoise{}, InertialPose{by_ins, Stamp(), 0.0}, true);
  }
  return votes;
}

TEST(MotionVotes, TheSourceThatContradictsTheWheelsIsFaulty) {
  EXPECT_GT(drive(1.3, 1.0, 1.0).verdict(), 0.9);
  EXPECT_LT(drive(1.0, 0.3, 1.0).verdict(), -0.9);
  EXPECT_EQ(drive(1.0, 1.0, 1.0).verdict(), 0.0);
  EXPECT_EQ(drive(1.0, 1.0, 1.3).verdict(), 0.0) << "of INS and LADAR none";
}

TEST(MotionVotes, OnlyALadarThatTwoOthersContradictIsPoor) {
  EXPECT_EQ(drive(1.0, 1.0, 1.0).ladar_scale().position, 1.0);
  EXPECT_GT(drive(1.0, 1.05, 1.0).ladar_scale().position, 5.0);
  EXPECT_EQ(drive(1.3, 1.0, 1.0).ladar_scale().position, 1.0);
  EXPECT_EQ(drive(1.0, 1.0, 1.3).ladar_scale().position, 1.0);
}

TEST(MotionVotes, AVoteNeedsOneSourceWithinTheToleranceAndOneBeyondIt) {
  EXPECT_EQ(vote(2.0, 1.0, 1.0, 0.5), 1.0);
  EXPECT_EQ(vote(1.0, 2.0, 1.0, 0.5), -1.0);
  EXPECT_EQ(vote(2.0, 3.0, 1.0, 0.5), 0.0);
  EXPECT_EQ(vote(1.0, 1.1, 1.0, 0.5), 0.0);
}

TEST(MotionVotes, ASumIsIncompleteAfterAGap) {
  MotionSum sum;
  for (int k = 0; k <= 10; ++k) sum.add(Stamp() + from_seconds(0.1 * k), 2.0);
  EXPECT_NEAR(sum.at(Stamp() + from_seconds(1.05)), 2.1, 1e-9);
  EXPECT_EQ(sum.complete_since(Stamp() + from_seconds(1.1)), Stamp());
  EXPECT_EQ(sum.complete_since(Stamp() + from_seconds(5.0)), Stamp::max());
  sum.add(Stamp() + from_seconds(5.0), 2.0);
  EXPECT_EQ(sum.complete_since(Stamp() + from_seconds(5.1)), Stamp() + from_seconds(5.0));
}

/// A slow curve of 20 s; the turn rates by INS and by LADAR are off by a constant.
/// @param votes  before it
MotionVotes turn(double ins_off_radps, double ladar_off_radps, MotionVotes votes = {}) {
  constexpr double kRate_radps = 0.05;
  constexpr double kSpeed_mps = 5.0;
  Pose ins;
  RollingMatch z;
  for (int k = 0; k <= 200; ++k) {
    const Stamp t = Stamp() + from_seconds(0.1 * k);
    const auto step = [&](double off_radps) {
      return exp_se3(
          (Vec6() << 0.1 * kSpeed_mps, 0.0, 0.0, 0.0, 0.0, 0.1 * (kRate_radps + off_radps))
              .finished());
    };
    ins = ins * step(ins_off_radps);
    z.T_rolling_vehicle = z.T_rolling_vehicle * step(ladar_off_radps);
    votes.add(t, OdometrySample{kSpeed_mps, 0.05, kRate_radps, 0.02}, 1.0, true);
    votes.add(t, z, 1e-4 * Mat6::Identity(), DriveNoise{}, InertialPose{ins, Stamp(), 0.0}, true);
  }
  EXPECT_EQ(votes.verdict(), 0.0) << "two seconds do not show it";
  return votes;
}

TEST(MotionVotes, LongTurnsShowSlowFaults) {
  EXPECT_GT(turn(0.008, 0.0).long_turns(), 0.9);
  EXPECT_LT(turn(0.0, -0.008).long_turns(), -0.9);
  EXPECT_GT(turn(0.0, -0.008).ladar_scale().rotation, 10.0);
  EXPECT_EQ(turn(0.002, -0.002).long_turns(), 0.0);
  EXPECT_EQ(turn(0.002, -0.002).ladar_scale().rotation, 1.0);
  EXPECT_EQ(turn(0.008, 0.007).long_turns(), 0.0) << "the wheels are the odd ones";
}

/// Of wheels whose driver does not always know the yaw rate.
TEST(MotionVotes, ASampleWithoutYawRateDoesNotSpoilTheTurns) {
  MotionVotes votes;
  votes.add(Stamp() - from_seconds(0.1), OdometrySample{5.0, 0.05, std::nan(""), 0.0}, 1.0, true);
  EXPECT_GT(turn(0.008, 0.0, votes).long_turns(), 0.9);
}

/// The INS may be the source that is wrong about the LADAR: once it is excluded it is no judge.
TEST(MotionVotes, AnExcludedInsDoesNotShowThatTheLadarIsWrong) {
  constexpr double kRate_radps = 0.05;
  for (const bool in_use : {false, true}) {
    MotionVotes votes;
    for (int k = 0; k <= 200; ++k) {
      const Stamp t = Stamp() + from_seconds(0.1 * k);
      const Pose ins{exp_so3(Vec3(0.0, 0.0, 0.1 * k * kRate_radps)), Vec3::Zero()};
      RollingMatch z;
      z.T_rolling_vehicle.q = exp_so3(Vec3(0.0, 0.0, 0.1 * k * (kRate_radps - 0.01)));
      votes.add(t, OdometrySample{5.0, 0.05, kRate_radps, 0.02}, 1.0, true);
      votes.add_turn(t, z, InertialPose{ins, Stamp(), 0.0}, in_use);
    }
    EXPECT_LT(votes.long_turns(), -0.9) << in_use;
    EXPECT_EQ(votes.ladar_scale().rotation > 10.0, in_use);
  }
}

TEST(MotionVotes, WithoutWheelsAndGpsThereIsNoVote) {
  MotionVotes votes;
  for (int k = 0; k <= 100; ++k) {
    RollingMatch z;
    z.T_rolling_vehicle.p.x() = 0.5 * k;
    votes.add(Stamp() + from_seconds(0.1 * k), z, 1e-4 * Mat6::Identity(), DriveNoise{},
              InertialPose{{}, Stamp(), 0.0}, true);
  }
  EXPECT_EQ(votes.verdict(), 0.0);
  EXPECT_EQ(votes.ladar_scale().position, 1.0);
}

/// A straight drive by motion that rises or sinks, by INS and by LADAR, without wheels and GPS.
double vote_of_climbs(double by_ins, double by_ladar, bool constrained) {
  MotionVotes votes;
  for (int k = 0; k <= 100; ++k) {
    RollingMatch z;
    z.T_rolling_vehicle.p = {0.5 * k, 0.0, by_ladar * 0.5 * k};
    Pose T_world_vehicle;
    T_world_vehicle.p = {0.5 * k, 0.0, by_ins * 0.5 * k};
    votes.add(Stamp() + from_seconds(0.1 * k), z, 1e-4 * Mat6::Identity(), DriveNoise{},
              InertialPose{T_world_vehicle, Stamp(), 0.0}, constrained);
  }
  return votes.verdict();
}

TEST(MotionVotes, TheSourceThatLeavesTheAxisOfTheVehicleIsFaulty) {
  EXPECT_GT(vote_of_climbs(0.1, 0.0, true), 0.9);
  EXPECT_LT(vote_of_climbs(0.0, 0.1, true), -0.9);
  EXPECT_EQ(vote_of_climbs(0.1, 0.1, true), 0.0);
  EXPECT_EQ(vote_of_climbs(0.1, 0.0, false), 0.0);
}

TEST(MotionVotes, AnArcHasNoMotionAcross) {
  // 10 m/s, turning and pitching at 0.2 rad/s each: one scan period.
  const Vec3 turn(0.0, 0.02, 0.02);
  Pose to;
  to.q = exp_so3(turn);
  to.p = Vec3(1.0, 0.0, 0.0) + 0.5 * turn.cross(Vec3(1.0, 0.0, 0.0));
  EXPECT_LT(motion_across(Pose{}, to).norm(), 1e-3);
}

TEST(LadarScales, AScaleAppliesFromItsBegin) {
  LadarScales scales;
  scales.add(Stamp() + from_seconds(10.0), {3.0, 4.0});
  scales.add(Stamp() + from_seconds(11.0), {5.0, 4.0});
  EXPECT_EQ(scales.at(Stamp() + from_seconds(9.9)).position, 1.0);
  EXPECT_EQ(scales.at(Stamp() + from_seconds(10.9)).position, 3.0);
  EXPECT_EQ(scales.at(Stamp() + from_seconds(11.0)).position, 5.0);
  RollingMatch z;
  z.information.setIdentity();
  const RollingMatch wide = scaled(z, {2.0, 10.0});
  EXPECT_DOUBLE_EQ(wide.information(0, 0), 0.25);
  EXPECT_DOUBLE_EQ(wide.information(5, 5), 0.01);
}

/// Otherwise a LADAR that is suspected measures nothing, also if it is the only source.
TEST(LadarScale, WhatAScanObservesIsStillObserved) {
  const RegistrationParams params;
  RollingMatch z;
  z.information = 100.0 * Mat6::Identity();             // 0.1 m
  z.information.diagonal().tail<3>().setConstant(1e4);  // 0.01 rad
  z.information(0, 0) = 1.0;                            // 1 m: not observed
  const RollingMatch wide = scaled(z, {10.0, 10.0});
  EXPECT_EQ(rolling_match(NavState{}, z, params, 1.0).dof, 5);
  const Residual<6> r = rolling_match(NavState{}, wide, params_of(wide, params), 1.0);
  EXPECT_EQ(r.dof, 5);
  EXPECT_GT(r.R(5, 5), 90.0 * rolling_match(NavState{}, z, params, 1.0).R(5, 5));
}

}  // namespace
}  // namespace rcs::wm

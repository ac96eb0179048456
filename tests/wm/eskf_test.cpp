// Laws of the filter's pieces.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "modules/wm/alignment.h"
#include "modules/wm/eskf.h"
#include "modules/wm/measurement_models.h"
#include "tests/wm/long_drive.h"
#include "tests/wm/synthetic.h"

namespace rcs::wm {
namespace {

constexpr double kNoGate = std::numeric_limits<double>::infinity();

/// A belief with a full covariance, somewhere in the world.
Belief some_belief(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> n(0.0, 0.1);
  Belief b;
  b.x.T_world_vehicle = {exp_so3(Vec3(0.1, -0.2, 0.9)), Vec3(100.0, -50.0, 3.0)};
  b.x.v_world = Vec3(3.0, 2.0, 0.1);
  b.x.inertial = true;
  Cov A;
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) A(i, j) = n(random);
  }
  b.P = A * A.transpose();
  return b;
}

TEST(StartEpoch, TheSameScanAgainAddsNoInformation) {
  // GIVEN an epoch just started WHEN the scan that started it is measured again
  const Belief b = some_belief(1);
  const Pose T_rv = {exp_so3(Vec3(0.0, 0.1, 1.0)), Vec3(20.0, 5.0, 0.0)};
  const Belief cloned = start_epoch(b, T_rv, 3);
  EXPECT_LT(rolling_pose_covariance(cloned).norm(), 1e-9 * b.P.norm());
  const RollingMatch match{T_rv, 1e6 * Mat6::Identity(), 3, false};
  const Fusion<6> f =
      update(cloned, rolling_match(cloned.x, match, RegistrationParams{}, 1.0), kNoGate);
  // THEN neither the state nor its uncertainty changes.
  EXPECT_LT(boxminus(f.belief.x, cloned.x).norm(), 1e-9);
  EXPECT_LT((f.belief.P - cloned.P).norm(), 1e-9 * cloned.P.norm());
}

TEST(StartEpoch, KeepsTheOtherStates) {
  const Belief b = some_belief(2);
  const Belief cloned = start_epoch(b, Pose{}, 1);
  EXPECT_EQ(cloned.P.topLeftCorner(kRolling, kRolling), b.P.topLeftCorner(kRolling, kRolling));
  EXPECT_GT(smallest_eigenvalue(cloned.P), -1e-9);
}

// After a silence the heading is known to 14 deg, but the vehicle drives along it: its velocity
// turns with the heading. A speed that is off, here by a wrong pitch and gravity, is no heading.
TEST(UpdateIterated, TheMeasuredSpeedDoesNotObserveAHeadingThatIsNotKnown) {
  constexpr double kSpeed_mps = 9.7;
  constexpr double kHeading_rad = 0.25;
  Belief b;
  b.x.T_world_vehicle.q = exp_so3(Vec3(0.0, 0.0, 1.2));
  b.x.v_world = b.x.T_world_vehicle.q * Vec3(kSpeed_mps, 0.0, 0.0);
  b.x.inertial = true;
  b.P = 1e-6 * Cov::Identity();
  // Errors: heading, with the velocity across; pitch, with the speed that gravity has added to it.
  ErrorState heading = ErrorState::Zero();
  heading[kAttitude + 2] = kHeading_rad;
  heading.segment<3>(kVelocity) = b.x.T_world_vehicle.q * Vec3(0.0, kSpeed_mps * kHeading_rad, 0.0);
  ErrorState pitch = ErrorState::Zero();
  pitch[kAttitude + 1] = 0.125;
  pitch.segment<3>(kVelocity) = b.x.T_world_vehicle.q * Vec3(0.06, 0.0, -kSpeed_mps * 0.125);
  b.P += heading * heading.transpose() + pitch * pitch.transpose();
  const auto residual_at = [](const NavState& x) {
    const Vec3 v = x.T_world_vehicle.q.conjugate() * x.v_world;
    Residual<1> z;
    z.r[0] = kSpeed_mps + 0.12 - v.x();
    z.H.middleCols<3>(kVelocity) = x.T_world_vehicle.q.toRotationMatrix().col(0).transpose();
    z.H.middleCols<3>(kAttitude) = Vec3(0.0, -v.z(), v.y()).transpose();
    z.R(0, 0) = 0.07 * 0.07;
    return z;
  };
  const Fusion<1> f = update_iterated<1>(b, residual_at, kNoGate, 0.15);
  ASSERT_EQ(f.reason, Reason::kAccepted);
  const Vec3 turn = log_so3(b.x.T_world_vehicle.q.conjugate() * f.belief.x.T_world_vehicle.q);
  EXPECT_GT(turn.y(), 0.03);  // beyond the first, linear step
  EXPECT_LT(std::abs(turn.z()), 0.01);
  EXPECT_GT(std::sqrt(f.belief.P(kAttitude + 2, kAttitude + 2)), 0.9 * kHeading_rad);
  EXPECT_GT(smallest_eigenvalue(f.belief.P), -1e-9);
}

TEST(LoosenWorld, KeepsTheCovarianceInTheRollingMap) {
  const Belief b =
      start_epoch(some_belief(3), {exp_so3(Vec3(0.1, 0.2, 0.3)), Vec3(9.0, 8.0, 7.0)}, 1);
  const Belief loose = loosen_world(b, Vec3(5.0, 5.0, 5.0), 0.2);
  EXPECT_LT((rolling_pose_covariance(loose) - rolling_pose_covariance(b)).norm(), 1e-9);
  EXPECT_GT(loose.P(0, 0), b.P(0, 0) + 24.0);
}

TEST(ChangeWorld, DoesNotChangeBodyQuantities) {
  const Belief b = start_epoch(some_belief(4), Pose{}, 1);
  const Pose T = {exp_so3(Vec3(0.0, 0.0, 2.0)), Vec3(1000.0, -2000.0, 5.0)};
  const Belief moved = change_world(b, T);
  EXPECT_LT((world_pose_covariance(moved, 0.0) - world_pose_covariance(b, 0.0)).norm(), 1e-9);
  const Pose d = T_rolling_vehicle(moved.x).inverse() * T_rolling_vehicle(b.x);
  EXPECT_LT(log_se3(d).norm(), 1e-9);
}

TEST(WorldPoseCovariance, IncludesTheMisalignmentOfTheIns) {
  const Belief b = some_belief(4);
  const Mat6 more = world_pose_covariance(b, 0.01) - world_pose_covariance(b, 0.0);
  Mat6 expected = Mat6::Zero();
  expected.diagonal().tail<3>().setConstant(1e-4);
  EXPECT_LT((more - expected).norm(), 1e-12);
}

/// Variance of (roll, pitch, heading) after a minute of such rates, from misaligned axes only.
template <class Rate>
Vec3 attitude_variance(const ProcessNoise& noise, const Rate& rate) {
  constexpr double kStep_s = 0.01;
  Belief b;
  b.x.stamp = from_utime(1'000'000);
  b.x.inertial = true;
  Lasting lasting;
  for (int i = 1; i <= 6000; ++i) {
    const Duration interval = from_seconds(kStep_s);
    const ImuSample imu{b.x.stamp + interval, interval, kStep_s * rate(kStep_s * i),
                        Vec3(0.0, 0.0, kStep_s * Earth{}.gravity)};
    lasting.add(imu, Earth{}.gravity, noise.motion_time_s);
    b = predict(b, imu, Earth{}, noise, DriveNoise{}, lasting);
  }
  return b.P.diagonal().segment<3>(kAttitude);
}

TEST(LowPassedMotion, ABendAddsHeadingVarianceAndABumpDoesNot) {
  ProcessNoise noise;
  noise.angle_random_walk = noise.gyro_instability = 0.0;
  constexpr double kRate = 0.3;
  const Vec3 bumps = attitude_variance(noise, [&](double t_s) {
    return Vec3(0.0, kRate * std::cos(2.0 * kPi * t_s), kRate * std::cos(4.0 * kPi * t_s));
  });
  const Vec3 bend = attitude_variance(noise, [&](double) { return Vec3(0.0, 0.0, kRate); });
  const double k = noise.scale_and_misalignment * kRate;
  EXPECT_NEAR(bend.z(), 2.0 * k * k * noise.motion_time_s * 60.0, 0.05 * bend.z());
  EXPECT_LT(bumps.z(), 0.02 * bend.z());
  EXPECT_LT(bumps.y(), 0.02 * bend.z());
}

/// In a long bend or on a long slope, misaligned axes have the same effect as a rising vehicle.
TEST(CrossAxisGain, IsEstimatedFromSustainedForces) {
  const WmParams params;
  for (const int axis : {0, 1}) {
    Belief b = initial_belief(params, from_utime(1'000'000));
    b.P.topLeftCorner<9, 9>() *= 1e-6;
    b.x.inertial = true;
    constexpr double kGain = 2e-3;
    constexpr double kForce = 1.5;
    constexpr double kStep_s = 0.01;
    const int first = axis == 0 ? kCrossAxisX : kCrossAxisY;
    const double at_start = std::sqrt(b.P(first + 2, first + 2));
    Vec3 v = Vec3::Zero();
    for (int i = 1; i <= 4000; ++i) {
      const double sign = (i / 1000) % 2 == 0 ? 1.0 : -1.0;  // otherwise it is equivalent to a bias
      Vec3 force(0.0, 0.0, Earth{}.gravity);
      force[axis] = sign * kForce;
      v[axis] += sign * kForce * kStep_s;
      force.z() += kGain * force[axis];
      const Duration interval = from_seconds(kStep_s);
      const ImuSample imu{b.x.stamp + interval, interval, Vec3::Zero(), kStep_s * force};
      b = predict(b, imu, Earth{}, params.ins, params.drive, Lasting{});
      if (i % 20 != 0) continue;
      GpsFix fix;
      fix.has_velocity = true;
      fix.v_world = v;
      fix.sigma_v_mps = Vec3::Constant(0.01);
      b = update(b, gps_velocity(b.x, fix, params.gps, Vec3::Zero()), kNoGate).belief;
    }
    const Vec3 found = axis == 0 ? b.x.cross_axis_x : b.x.cross_axis_y;
    const double sigma = std::sqrt(b.P(first + 2, first + 2));
    EXPECT_LT(sigma, 0.2 * at_start) << axis;
    EXPECT_NEAR(found.z(), kGain, 4.0 * sigma + 0.05 * kGain) << axis;
  }
}

TEST(Update, UnobservedDirectionsAreNotChanged) {
  // GIVEN a belief whose rolling pose is uncertain in all directions, a corridor along vehicle x
  Belief b = start_epoch(some_belief(5), Pose{}, 1);
  b.P.setZero();
  for (int i = 0; i < 9; ++i) b.P(i, i) = 1.0;
  Mat6 information = 1e4 * Mat6::Identity();
  information.row(0).setZero();
  information.col(0).setZero();
  // WHEN a match with an error in every direction is fused
  Vec6 off;
  off << 0.5, 0.02, -0.01, 0.001, 0.002, -0.001;
  const RollingMatch match{T_rolling_vehicle(b.x) * exp_se3(off), information, 1, false};
  const Residual<6> z = rolling_match(b.x, match, RegistrationParams{}, 1.0);
  EXPECT_EQ(z.dof, 5);
  const Fusion<6> f = update(b, z, kNoGate);
  // THEN neither the position along x nor its variance changes.
  const Vec6 moved = log_se3(b.x.T_world_vehicle.inverse() * f.belief.x.T_world_vehicle);
  EXPECT_LT(std::abs(moved[0]), 1e-3);  // second order of the rotation
  EXPECT_NEAR(moved[1], 0.02, 1e-3);
  EXPECT_NEAR(world_pose_covariance(f.belief, 0.0)(0, 0), 1.0, 1e-3);
  EXPECT_LT(world_pose_covariance(f.belief, 0.0)(1, 1), 1e-2);
}

TEST(Update, AMatchWithoutObservedDirectionsIsRejectedWithAReason) {
  const Belief b = start_epoch(some_belief(6), Pose{}, 1);
  const RollingMatch match{Pose{}, Mat6::Zero(), 1, false};
  EXPECT_EQ(update(b, rolling_match(b.x, match, RegistrationParams{}, 1.0), kNoGate).reason,
            Reason::kUnobserved);
}

TEST(Update, ARejectedMeasurementChangesNothing) {
  const Belief b = some_belief(7);
  GpsFix fix;
  fix.p_world = Vec3(1e4, 0.0, 0.0);
  const Fusion<3> f = update(b, gps_position(b.x, fix, GpsParams{}), 20.0);
  EXPECT_EQ(f.reason, Reason::kGate);
  EXPECT_EQ(f.belief.P, b.P);
}

TEST(Update, ChiSquareGatesMatchTheTables) {
  // Quantiles of chi-square at 0.9999 (scipy.stats.chi2.ppf). The cube-root approximation is
  // slightly too large.
  const double expected[] = {15.137, 18.421, 21.108, 23.513, 25.745, 27.856};
  for (int dof = 1; dof <= 6; ++dof) {
    const double gate = chi_square_gate(dof, 1e-4);
    EXPECT_GE(gate, expected[dof - 1]);
    EXPECT_LT(gate, 1.08 * expected[dof - 1]);
  }
}

TEST(Registration, CovarianceIsTheInverseOfTheInformation) {
  RegistrationParams params;
  params.inflation = 1.0;
  params.sigma_floor_m = params.sigma_floor_rad = params.sigma_time_s = 0.0;
  std::mt19937 random(8);
  std::normal_distribution<double> n(0.0, 30.0);
  Mat6 A;
  for (int i = 0; i < 36; ++i) A(i / 6, i % 6) = n(random);
  const Mat6 information = A * A.transpose() + 100.0 * Mat6::Identity();
  int unobserved = -1;
  const Mat6 C = registration_covariance(NavState{}, information, params, &unobserved);
  EXPECT_EQ(unobserved, 0);
  EXPECT_LT((C * information - Mat6::Identity()).norm(), 1e-9);
}

TEST(Covariance, StaysSymmetricAndPositiveForMinutes) { expect_covariance_stays_sound(180.0, 50); }

/// A float solution becomes a fixed one: if the same time-correlated error were scaled down with
/// the reported sigma, the position would seem to be known to centimetres.
TEST(GpsBias, TheTimeCorrelatedErrorDoesNotShrinkWithTheReportedSigma) {
  const Model model{WmParams{}};
  FilterState s;
  s.belief.P.setZero();
  s.belief.P.diagonal().segment<3>(kPosition).setConstant(100.0);
  s.belief.P.diagonal().segment<3>(kGpsBias).setOnes();
  s.belief.x.stamp = Stamp(from_seconds(100.0));
  s.bookkeeping.georeferenced = true;
  const auto fixes = [&](double sigma_m, double error_m, double length_s) {
    for (double t_s = 0.0; t_s < length_s; t_s += 0.2) {
      GpsFix fix;
      fix.p_world = model.params.gps.lever_m + Vec3(error_m, 0.0, 0.0);
      fix.sigma_m.setConstant(sigma_m);
      Innovations unread;
      apply(model, {s.belief.x.stamp, fix}, &s, &unread);
      s.belief.x.stamp += from_seconds(0.2);
    }
    return std::sqrt(s.belief.P(kPosition, kPosition));
  };
  EXPECT_GT(fixes(1.5, 1.2, 10.0), 1.2);
  EXPECT_GT(fixes(0.3, 0.2, 3.0), 0.8) << "the sigma may return to 1.5 m at any moment";
  const double settled_m = fixes(0.3, 0.2, 20.0);
  EXPECT_GT(settled_m, 0.22);  // 0.9 of 0.3 is time-correlated
  EXPECT_LT(settled_m, 0.35);
  EXPECT_NEAR(s.belief.x.T_world_vehicle.p.x(), 0.2, 0.35);
  EXPECT_GT(fixes(1.5, 0.2, 0.4), 0.22) << "a growing sigma neither removes nor adds information";
  double flapping_m = 1.0;
  for (int k = 0; k < 40; ++k) flapping_m = fixes(k % 2 == 0 ? 0.3 : 1.5, 0.2, 0.4);
  EXPECT_GT(flapping_m, 0.2);
  EXPECT_GT(s.belief.P.diagonal().minCoeff(), -1e-12);
}

}  // namespace
}  // namespace rcs::wm

// Every analytic derivative against central differences.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "modules/wm/eskf.h"
#include "modules/wm/measurement_models.h"

namespace rcs::wm {
namespace {

Vec6 random6(std::mt19937* random, double sigma) {
  std::normal_distribution<double> n(0.0, sigma);
  Vec6 v;
  for (int i = 0; i < 6; ++i) v[i] = n(*random);
  return v;
}

NavState some_state(unsigned seed, bool inertial) {
  std::mt19937 random(seed);
  NavState x;
  x.stamp = from_utime(5'000'000);
  x.T_world_vehicle = exp_se3(random6(&random, 1.5));
  x.T_world_rolling = exp_se3(random6(&random, 1.0));
  x.v_world = random6(&random, 6.0).head<3>();
  x.gyro_bias = random6(&random, 0.01).head<3>();
  x.accel_bias = random6(&random, 0.1).head<3>();
  x.cross_axis_x = random6(&random, 0.01).head<3>();
  x.cross_axis_y = random6(&random, 0.01).head<3>();
  x.rate_vehicle = random6(&random, 0.4).head<3>();
  x.mount = random6(&random, 0.02).head<3>();
  x.slip = random6(&random, 1.0).head<3>();
  x.slip_per_climb = 0.1;
  x.wheel_scale = 1.02;
  x.map_epoch = 1;
  x.inertial = inertial;
  return x;
}

/// The filter's transition along each error direction, read off the covariance it propagates: for
/// P = d d^T, P' - Q = (F d)(F d)^T.
template <class Predict>
void expect_transition(const NavState& x, const Predict& predict_belief) {
  const Cov Q = predict_belief(Belief{x, Cov::Zero()}).P;
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  for (int k = 0; k < kSize + 5; ++k) {
    ErrorState d = ErrorState::Zero();
    if (k < kSize) {
      d[k] = 1.0;
    } else {
      for (int i = 0; i < kSize; ++i) d[i] = normal(random);
    }
    constexpr double kStep = 1e-6;
    const NavState plus = predict_belief(Belief{boxplus(x, kStep * d), Cov::Zero()}).x;
    const NavState minus = predict_belief(Belief{boxplus(x, -kStep * d), Cov::Zero()}).x;
    const ErrorState Fd = boxminus(plus, minus) / (2.0 * kStep);
    const Cov P = predict_belief(Belief{x, d * d.transpose()}).P - Q;
    const Cov expected = Fd * Fd.transpose();
    EXPECT_LT((P - expected).cwiseAbs().maxCoeff(), 1e-6 * (1.0 + expected.cwiseAbs().maxCoeff()))
        << "direction " << k;
  }
}

/// @param predict_by  Belief, ImuSample, Earth -> Belief
template <class Predict>
void expect_inertial_transition(const Predict& predict_by) {
  NavState x = some_state(1, true);
  const Earth earth = earth_at({radians(49.0), radians(8.0), {100.0}});
  const ImuSample imu{x.stamp + Duration(10'000), Duration(10'000), Vec3(0.004, -0.01, 0.02),
                      Vec3(0.05, -0.03, 0.098)};
  x.rate_vehicle.setZero();
  // The rate follows the gyro: its own error does not propagate, so it is omitted from the
  // directions.
  expect_transition(x, [&](Belief b) {
    b.P.middleRows<3>(kRate).setZero();
    b.P.middleCols<3>(kRate).setZero();
    Belief next = predict_by(b, imu, earth);
    next.x.rate_vehicle.setZero();
    return next;
  });
}

TEST(Predict, InertialTransitionIsTheDerivative) {
  expect_inertial_transition([](const Belief& b, const ImuSample& imu, const Earth& earth) {
    return predict(b, imu, earth, ProcessNoise{}, DriveNoise{}, Lasting{});
  });
}

TEST(Predict, TransitionByRotationIsTheDerivative) {
  expect_inertial_transition([](const Belief& b, const ImuSample& imu, const Earth& earth) {
    return predict_by_rotation(b, imu, earth, MotionNoise{}, ProcessNoise{}, DriveNoise{},
                               Lasting{});
  });
}

TEST(Predict, CoastingTransitionIsTheDerivative) {
  const NavState x = some_state(2, false);
  expect_transition(x, [&](const Belief& b) {
    return predict(b, x.stamp + Duration(100'000), MotionNoise{}, ProcessNoise{}, DriveNoise{});
  });
}

TEST(Predict, InertialNoiseEntersThroughTheIncrements) {
  // GIVEN Q of one step WHEN the increments are perturbed numerically THEN their images span Q
  NavState x = some_state(4, true);
  x.map_epoch = -1;
  x.cross_axis_x.setZero();
  x.cross_axis_y.setZero();  // its product with the noise is negligible
  const Earth earth;
  const double dt = 0.01;
  const ImuSample imu{x.stamp + Duration(10'000), Duration(10'000), Vec3(0.004, -0.01, 0.02),
                      Vec3(0.05, -0.03, 0.098)};
  ProcessNoise noise;
  noise.scale_and_misalignment = 0.0;
  noise.gyro_instability = noise.accel_instability = 0.0;
  const Cov Q = predict(Belief{x, Cov::Zero()}, imu, earth, noise, DriveNoise{}, Lasting{}).P;
  Mat<9> expected = Mat<9>::Zero();
  for (int k = 0; k < 6; ++k) {
    ImuSample plus = imu, minus = imu;
    constexpr double kStep = 1e-7;
    (k < 3 ? plus.delta_angle[k] : plus.delta_v[k - 3]) += kStep;
    (k < 3 ? minus.delta_angle[k] : minus.delta_v[k - 3]) -= kStep;
    const NavState a =
        predict(Belief{x, Cov::Zero()}, plus, earth, noise, DriveNoise{}, Lasting{}).x;
    const NavState b =
        predict(Belief{x, Cov::Zero()}, minus, earth, noise, DriveNoise{}, Lasting{}).x;
    const Vec<9> g = boxminus(a, b).head<9>() / (2.0 * kStep);
    const double sigma = k < 3 ? noise.angle_random_walk : noise.velocity_random_walk;
    expected += sigma * sigma * dt * g * g.transpose();
  }
  EXPECT_LT((Q.topLeftCorner<9, 9>() - expected).norm(), 1e-6 * expected.norm());
}

template <class Measure>
void expect_jacobian(const NavState& x, double tolerance, const Measure& measure) {
  const auto at_x = measure(x);
  for (int k = 0; k < kSize; ++k) {
    ErrorState d = ErrorState::Zero();
    constexpr double kStep = 1e-6;
    d[k] = kStep;
    // r = measured - predicted, so that dr = -H d.
    const Eigen::VectorXd numeric =
        -(measure(boxplus(x, d)).r - measure(boxplus(x, -d)).r) / (2.0 * kStep);
    EXPECT_LT((at_x.H.col(k) - numeric).norm(), tolerance) << "column " << k;
  }
}

Mat6 full_information() { return 1e4 * Mat6::Identity(); }

TEST(Measurements, JacobiansAreTheDerivatives) {
  GpsParams gps;
  gps.lever_m = Vec3(0.5, -0.3, 1.2);
  GpsFix fix;
  fix.p_world = Vec3(1.0, 2.0, 3.0);
  fix.sigma_m = Vec3(0.3, 0.3, 0.6);
  fix.v_world = Vec3(2.0, 1.0, 0.0);
  for (const bool inertial : {true, false}) {
    NavState x = some_state(inertial ? 5 : 6, inertial);
    expect_jacobian(x, 1e-7, [&](const NavState& y) { return gps_position(y, fix, gps); });
    expect_jacobian(x, 1e-7, [&](const NavState& y) {
      NavState moved = y;  // with an INS the rate is the gyro rate minus its bias
      if (inertial) moved.rate_vehicle -= y.gyro_bias - x.gyro_bias;
      if (inertial) moved.rate_vehicle -= y.rate_vehicle - x.rate_vehicle;
      return gps_velocity(moved, fix, gps, Vec3(0.5, -1.0, 0.2));
    });
    expect_jacobian(x, 1e-6, [&](const NavState& y) {
      return wheel_speed(y, {5.0, 0.1, 0.2, 0.01}, OdometryParams{});
    });
    expect_jacobian(x, 1e-6,
                    [&](const NavState& y) { return non_holonomic(y, OdometryParams{}, 1.0); });
    expect_jacobian(x, 1e-7,
                    [&](const NavState& y) { return zero_velocity(y, StillnessParams{}); });
    expect_jacobian(x, 1e-6,
                    [&](const NavState& y) { return level(y, Vec3(0.1, 0.2, 9.7), 9.81, 0.1); });
  }
}

// The slip on a climb is a product: where both factors are hardly known, the wheels estimate
// neither from it. Share of the drives whose pitch is then off by more than three sigmas; at 12 m/s
// and from an estimated slip of 0.09, as after a silence of all sensors.
TEST(Measurements, AnUnknownSlipOnAnUnknownClimbIsNotEstimated) {
  constexpr int kDrives = 300;
  constexpr int kSamples = 10;
  constexpr double kTilt_rad = 0.1;
  constexpr double kSlip = 0.1;
  const OdometryParams params;
  const auto share_off = [&](double unknown_tilt_rad) {
    std::mt19937 random(11);
    std::normal_distribution<double> normal(0.0, 1.0);
    int off = 0;
    for (int drive = 0; drive < kDrives; ++drive) {
      Belief b;
      b.x.inertial = true;
      b.x.v_world = Vec3(12.0, 0.0, 0.0);
      b.x.slip_per_climb = 0.09;
      b.P = 1e-6 * Cov::Identity();
      b.P.diagonal().segment<2>(kAttitude).setConstant(kTilt_rad * kTilt_rad);
      b.P(kClimbSlip, kClimbSlip) = kSlip * kSlip;
      b.P(kVelocity, kVelocity) = 0.05 * 0.05;
      ErrorState d = ErrorState::Zero();
      d[kAttitude + 1] = kTilt_rad * normal(random);
      d[kClimbSlip] = kSlip * normal(random);
      NavState truth = boxplus(b.x, d);
      truth.v_world = truth.T_world_vehicle.q * Vec3(12.0 + 0.05 * normal(random), 0.0, 0.0);
      // The velocity is known along the vehicle, not in frame world.
      b.P(kVelocity + 2, kVelocity + 2) += 144.0 * kTilt_rad * kTilt_rad;
      b.P(kVelocity + 2, kAttitude + 1) = b.P(kAttitude + 1, kVelocity + 2) =
          -12.0 * kTilt_rad * kTilt_rad;
      for (int i = 0; i < kSamples; ++i) {
        OdometrySample z;
        z.speed_mps = -wheel_speed(truth, z, params).r[0] + 0.05 * normal(random);
        z.sigma_speed_mps = 0.05;
        const double gate = std::numeric_limits<double>::infinity();
        b = update_iterated<2>(
                b, [&](const NavState& x) { return wheel_speed(x, z, params, unknown_tilt_rad); },
                gate, 0.15)
                .belief;
      }
      const double error_rad = boxminus(truth, b.x)[kAttitude + 1];
      if (std::abs(error_rad) > 3.0 * std::sqrt(b.P(kAttitude + 1, kAttitude + 1))) ++off;
    }
    return static_cast<double>(off) / kDrives;
  };
  EXPECT_GT(share_off(0.0), 0.1) << "the test measures nothing";
  EXPECT_LT(share_off(kTilt_rad), 0.02);
}

TEST(Measurements, RegistrationJacobiansAreTheDerivativesAwayFromZeroResidual) {
  const NavState x = some_state(7, true);
  std::mt19937 random(8);
  Vec6 off = random6(&random, 0.03);
  RollingMatch rolling{T_rolling_vehicle(x) * exp_se3(off), full_information(), 1, false};
  // Information with equal eigenvalues has no stable eigenvectors: make them distinct.
  for (int i = 0; i < 6; ++i) rolling.information(i, i) *= 1.0 + 3.0 * i;
  expect_jacobian(x, 1e-4, [&](const NavState& y) {
    return rolling_match(y, rolling, RegistrationParams{}, 1.0);
  });
  PriorMatch prior;
  prior.T_world_vehicle = x.T_world_vehicle * exp_se3(off);
  prior.information = rolling.information;
  expect_jacobian(x, 1e-4,
                  [&](const NavState& y) { return prior_match(y, prior, PriorMapParams{}, 1.0); });
}

TEST(NavState, PoseJacobiansAreTheDerivatives) {
  const NavState x = some_state(9, true);
  const Mat<6, kSize> world = world_pose_jacobian(x);
  const Mat<6, kSize> rolling = rolling_pose_jacobian(x);
  for (int k = 0; k < kSize; ++k) {
    ErrorState d = ErrorState::Zero();
    d[k] = 1e-6;
    const NavState a = boxplus(x, d), b = boxplus(x, -d);
    const Vec6 w = log_se3(b.T_world_vehicle.inverse() * a.T_world_vehicle) / 2e-6;
    const Vec6 r = log_se3(T_rolling_vehicle(b).inverse() * T_rolling_vehicle(a)) / 2e-6;
    EXPECT_LT((world.col(k) - w).norm(), 1e-7);
    EXPECT_LT((rolling.col(k) - r).norm(), 1e-7);
  }
}

TEST(NavState, BoxminusInvertsBoxplus) {
  const NavState x = some_state(10, true);
  std::mt19937 random(11);
  std::normal_distribution<double> n(0.0, 0.5);
  ErrorState d;
  for (int i = 0; i < kSize; ++i) d[i] = n(random);
  EXPECT_LT((boxminus(boxplus(x, d), x) - d).norm(), 1e-12);
}

}  // namespace
}  // namespace rcs::wm

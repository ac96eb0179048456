#include "modules/wm/measurement_models.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace rcs::wm {
namespace {

/// Derivative of the body rate's error: the gyro's bias with an INS, the rate state without.
struct RateError {
  int index;
  double sign;
};
RateError rate_error(const NavState& x) {
  return x.inertial ? RateError{kGyroBias, -1.0} : RateError{kRate, 1.0};
}

/// Inverse of the left Jacobian of SE(3); the series' next term is of fourth order.
Mat6 left_jacobian_inverse_se3(const Vec6& xi) {
  Mat6 ad = Mat6::Zero();
  ad.topLeftCorner<3, 3>() = ad.bottomRightCorner<3, 3>() = hat(xi.tail<3>());
  ad.topRightCorner<3, 3>() = hat(xi.head<3>());
  return Mat6::Identity() - 0.5 * ad + (1.0 / 12.0) * ad * ad;
}

/// Errors that the information of a scan does not contain: floors, clock, LADAR mount.
Mat6 systematic_covariance(const NavState& x, const RegistrationParams& params) {
  const Vec3 v_vehicle = x.T_world_vehicle.q.conjugate() * x.v_world;
  const double t2 = params.sigma_time_s * params.sigma_time_s;
  Mat6 C = Mat6::Zero();
  C.topLeftCorner<3, 3>() = t2 * v_vehicle * v_vehicle.transpose();
  C.bottomRightCorner<3, 3>() = t2 * x.rate_vehicle * x.rate_vehicle.transpose();
  C.diagonal().head<3>().array() += params.sigma_floor_m * params.sigma_floor_m;
  C.diagonal().tail<3>().array() += params.sigma_floor_rad * params.sigma_floor_rad;
  return C;
}

/// Eigenvectors of the information, with angles scaled to metres by the lever arm: u_i^T W e has
/// the variance 1 / lambda_i, independently of the others.
struct Directions {
  Mat6 A;       ///< rows: u_i^T W
  Vec6 lambda;  ///< information [1/m^2], ascending
};
Directions directions(const Mat6& information, double arm_m) {
  Vec6 w;
  w << 1.0, 1.0, 1.0, arm_m, arm_m, arm_m;
  const Vec6 w_inverse = w.cwiseInverse();
  const Mat6 symmetric = 0.5 * (information + information.transpose());
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(w_inverse.asDiagonal() * symmetric *
                                                  w_inverse.asDiagonal());
  return {eigen.eigenvectors().transpose() * w.asDiagonal(), eigen.eigenvalues()};
}

Eigen::Array<bool, 6, 1> observed(const Directions& d, const RegistrationParams& params) {
  return d.lambda.array() > 1.0 / (params.observed_sigma_m * params.observed_sigma_m);
}

/// Covariance of the perturbation whose components along the directions have these variances.
Mat6 covariance(const Directions& d, const Vec6& variance, double arm_m) {
  // A = U^T W with U orthogonal, so A^-1 = W^-1 U = W^-2 A^T.
  Vec6 w_inverse2;
  w_inverse2.head<3>().setOnes();
  w_inverse2.tail<3>().setConstant(1.0 / (arm_m * arm_m));
  const Mat6 A_inverse = w_inverse2.asDiagonal() * d.A.transpose();
  return A_inverse * variance.asDiagonal() * A_inverse.transpose();
}

/// @param r  full residual; @param J  its Jacobian; rows along unobserved directions stay zero
Residual<6> project(const Vec6& r, const Mat<6, kSize>& J, const Mat6& information,
                    const Mat6& systematic, const RegistrationParams& params, double weight) {
  const Directions d = directions(information, params.arm_m);
  const auto is_observed = observed(d, params);
  const Mat6 R_systematic = d.A * systematic * d.A.transpose();
  Residual<6> z;
  z.dof = 0;
  int row[6];
  for (int i = 0; i < 6; ++i) {
    if (is_observed[i]) row[z.dof++] = i;
  }
  for (int a = 0; a < z.dof; ++a) {
    const int i = row[a];
    z.r[i] = d.A.row(i) * r;
    z.H.row(i) = d.A.row(i) * J;
    for (int b = 0; b < z.dof; ++b) z.R(i, row[b]) = R_systematic(i, row[b]) / weight;
    z.R(i, i) += params.inflation / (d.lambda[i] * weight);
  }
  return z;
}

}  // namespace

Residual<3> gps_position(const NavState& x, const GpsFix& z, const GpsParams& params) {
  const Mat3 R = x.T_world_vehicle.rotation();
  const Vec3 sigma = z.sigma_m.cwiseMax(params.sigma_floor_m);
  const Vec3 scale = params.correlated * (z.slow_m.isZero() ? sigma : z.slow_m);
  Residual<3> out;
  out.r = z.p_world - (x.T_world_vehicle * params.lever_m + scale.cwiseProduct(x.gps_bias));
  out.H.block<3, 3>(0, kPosition).setIdentity();
  out.H.block<3, 3>(0, kAttitude) = -R * hat(params.lever_m);
  out.H.block<3, 3>(0, kGpsBias) = scale.asDiagonal();
  const double white = 1.0 - params.correlated * params.correlated;
  out.R = (white * sigma.cwiseAbs2()).asDiagonal();
  out.R += params.sigma_time_s * params.sigma_time_s * x.v_world * x.v_world.transpose();
  return out;
}

Residual<3> without_height(const Residual<3>& z) {
  Residual<3> out = z;
  out.dof = 2;
  out.r[2] = 0.0;
  out.H.row(2).setZero();
  out.R.row(2).setZero();
  out.R.col(2).setZero();
  out.R(2, 2) = 1.0;
  return out;
}

std::optional<Vec3> worth(const Vec3& claimed_sigma_m, const GpsQuality& quality) {
  // Best range accuracy of each kind of solution [m]; typical of data sheets of receivers.
  constexpr double kRange_m[] = {0.5, 0.25, 0.05, 0.005};
  constexpr int kFewest = 4;
  constexpr double kUsualHdop = 1.0;
  constexpr double kUsualVdop = 1.6;
  if (quality.satellites != 0 && quality.satellites < kFewest) return std::nullopt;
  const double range_m = kRange_m[static_cast<std::size_t>(quality.fix)];
  const double h = range_m * (quality.hdop > 0.0 ? quality.hdop : kUsualHdop);
  const double v = range_m * (quality.vdop > 0.0 ? quality.vdop : kUsualVdop);
  return claimed_sigma_m.cwiseMax(Vec3(h, h, v));
}

Residual<3> gps_velocity(const NavState& x, const GpsFix& z, const GpsParams& params,
                         const Vec3& accel_world) {
  const Mat3 R = x.T_world_vehicle.rotation();
  const Vec3 lever_rate = x.rate_vehicle.cross(params.lever_m);
  const RateError rate = rate_error(x);
  Residual<3> out;
  out.r = z.v_world - (x.v_world + R * lever_rate);
  out.H.block<3, 3>(0, kVelocity).setIdentity();
  out.H.block<3, 3>(0, kAttitude) = -R * hat(lever_rate);
  out.H.block<3, 3>(0, rate.index) = -rate.sign * R * hat(params.lever_m);
  out.R = z.sigma_v_mps.cwiseAbs2().asDiagonal();
  out.R += params.sigma_time_s * params.sigma_time_s * accel_world * accel_world.transpose();
  return out;
}

Residual<6> rolling_match(const NavState& x, const RollingMatch& z,
                          const RegistrationParams& params, double weight) {
  const Vec6 r = log_se3(T_rolling_vehicle(x).inverse() * z.T_rolling_vehicle);
  return project(r, left_jacobian_inverse_se3(r) * rolling_pose_jacobian(x), z.information,
                 systematic_covariance(x, params), params, weight);
}

MapBias modelled_bias(const MapBias& said, const WmParams& params) {
  if (!(said.sigma_m > 0.0)) return {params.drive.map_sigma_m, params.drive.map_length_m};
  // Its bias may be larger than stated, but the bias changes along the path as stated.
  const double margin = params.prior.bias_margin;
  return {margin * said.sigma_m, margin * margin * std::max(1.0, said.length_m)};
}

Residual<6> prior_match(const NavState& x, const PriorMatch& z, const PriorMapParams& params,
                        double weight) {
  Pose predicted = T_world_seen(x);
  predicted.p += x.map_bias;
  const Vec6 r = log_se3(predicted.inverse() * z.T_world_vehicle);
  Mat<6, kSize> J = seen_pose_jacobian(x);
  J.block<3, 3>(0, kMapBias) = J.block<3, 3>(0, kPosition);
  Mat6 systematic = systematic_covariance(x, params.match);
  systematic.diagonal().head<3>().array() += params.mount_sigma_m * params.mount_sigma_m;
  return project(r, left_jacobian_inverse_se3(r) * J, z.information, systematic, params.match,
                 weight);
}

Mat6 observed_covariance(const Mat6& information, const RegistrationParams& params) {
  const Directions d = directions(information, params.arm_m);
  return covariance(d, observed(d, params).select(d.lambda.cwiseInverse(), 0.0), params.arm_m);
}

Mat6 registration_covariance(const NavState& x, const Mat6& information,
                             const RegistrationParams& params, int* unobserved) {
  constexpr double kUnknown_m = 1000.0;
  const Directions d = directions(information, params.arm_m);
  const auto is_observed = observed(d, params);
  *unobserved = 6 - static_cast<int>(is_observed.count());
  const Vec6 variance =
      is_observed.select(params.inflation * d.lambda.cwiseInverse(), kUnknown_m * kUnknown_m);
  return covariance(d, variance, params.arm_m) + systematic_covariance(x, params);
}

Vec3 displacement(const NavState& x, const RollingMatch& z, const RegistrationParams& params) {
  constexpr double kLarge_m2 = 100.0;  // between the variances of observed directions and of others
  int unobserved = 0;
  const Mat3 variance =
      registration_covariance(x, z.information, params, &unobserved).topLeftCorner<3, 3>();
  const Vec3 apart_m = (T_rolling_vehicle(x).inverse() * z.T_rolling_vehicle).p;
  const Mat3 sum = variance + kLarge_m2 * Mat3::Identity();
  return x.T_world_vehicle.q * Vec3(kLarge_m2 * sum.llt().solve(apart_m));
}

Residual<2> wheel_speed(const NavState& x, const OdometrySample& z, const OdometryParams& params,
                        double unknown_tilt_rad) {
  const Mat3 R_vehicle_world = x.T_world_vehicle.rotation().transpose();
  const Vec3 v_vehicle = R_vehicle_world * x.v_world;
  const double climb = R_vehicle_world(0, 2);
  const double ratio = x.wheel_scale + params.slip * x.slip.x() + x.slip_per_climb * climb;
  const double sigma = std::max(z.sigma_speed_mps, params.sigma_floor_mps);
  Residual<2> out;
  out.dof = 1;
  out.r[0] = z.speed_mps - ratio * v_vehicle.x();
  out.H.block<1, 3>(0, kVelocity) = ratio * R_vehicle_world.row(0);
  const Vec3 climb_by_attitude = hat(R_vehicle_world.col(2)).row(0);
  out.H.block<1, 3>(0, kAttitude) = ratio * hat(v_vehicle).row(0);
  out.H(0, kWheelScale) = v_vehicle.x();
  out.H(0, kSlip) = params.slip * v_vehicle.x();
  out.R(0, 0) = sigma * sigma;
  if (unknown_tilt_rad > 0.0) {
    const double climb_slip = std::hypot(x.slip_per_climb, params.climb_slip);
    const double slip_mps = climb_slip * unknown_tilt_rad * v_vehicle.x();
    out.R(0, 0) += slip_mps * slip_mps;
  } else {
    out.H.block<1, 3>(0, kAttitude) +=
        x.slip_per_climb * v_vehicle.x() * climb_by_attitude.transpose();
    out.H(0, kClimbSlip) = climb * v_vehicle.x();
  }
  if (!x.inertial && std::isfinite(z.yaw_rate_radps)) {
    out.dof = 2;
    out.r[1] = z.yaw_rate_radps - x.rate_vehicle.z();
    out.H(1, kRate + 2) = 1.0;
    out.R(1, 1) = z.sigma_yaw_rate_radps * z.sigma_yaw_rate_radps;
  }
  return out;
}

Residual<2> non_holonomic(const NavState& x, const OdometryParams& params, double shaking_mps2) {
  const Mat3 R_vehicle_world = x.T_world_vehicle.rotation().transpose();
  const Vec3 v_vehicle = R_vehicle_world * x.v_world;
  Mat<2, 3> across;  // the part of the velocity that is neither along the vehicle nor slip
  across << -params.side_slip * x.slip.y(), 1.0, 0.0,  //
      -params.side_slip * x.slip.z(), 0.0, 1.0;
  Residual<2> out;
  out.r = -across * v_vehicle;
  out.H.block<2, 3>(0, kVelocity) = across * R_vehicle_world;
  out.H.block<2, 3>(0, kAttitude) = across * hat(v_vehicle);
  out.H(0, kSlip + 1) = out.H(1, kSlip + 2) = -params.side_slip * v_vehicle.x();
  const double heave_mps = shaking_mps2 / (2.0 * kPi * params.heave_hz);
  out.R =
      Vec2(params.lateral_mps, std::hypot(params.vertical_mps, heave_mps)).cwiseAbs2().asDiagonal();
  return out;
}

Residual<3> level(const NavState& x, const Vec3& specific_force, double gravity,
                  double sigma_mps2) {
  const Vec3 up_vehicle = x.T_world_vehicle.q.conjugate() * Vec3(0.0, 0.0, gravity);
  Residual<3> out;
  out.r = specific_force - (up_vehicle + x.accel_bias);
  out.H.block<3, 3>(0, kAttitude) = hat(up_vehicle);
  out.H.block<3, 3>(0, kAccelBias).setIdentity();
  out.R = sigma_mps2 * sigma_mps2 * Mat3::Identity();
  return out;
}

Residual<3> zero_velocity(const NavState& x, const StillnessParams& params) {
  Residual<3> out;
  out.r = -x.v_world;
  out.H.block<3, 3>(0, kVelocity).setIdentity();
  out.R = params.sigma_mps * params.sigma_mps * Mat3::Identity();
  return out;
}

double chi_square_gate(int dof, double false_alarm) {
  // Normal quantile by Abramowitz and Stegun 26.2.23, |error| < 4.5e-4.
  const double t = std::sqrt(-2.0 * std::log(false_alarm));
  const double u = t - (2.515517 + t * (0.802853 + t * 0.010328)) /
                           (1.0 + t * (1.432788 + t * (0.189269 + t * 0.001308)));
  const double k = 2.0 / (9.0 * dof);
  const double cube_root = 1.0 - k + u * std::sqrt(k);
  return dof * cube_root * cube_root * cube_root;
}

}  // namespace rcs::wm

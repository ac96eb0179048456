#pragma once
// The belief of WM: the nominal state on the manifold, and the covariance of its error.

#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"

namespace rcs::wm {

/// First index of each block of the error state. Attitude and poses have right perturbations, all
/// other states are additive.
enum Index : int {
  kPosition = 0,     ///< of p_world_vehicle [m], world axes
  kVelocity = 3,     ///< of v_world [m/s]
  kAttitude = 6,     ///< R_world_vehicle * exp(phi) [rad], vehicle axes
  kGyroBias = 9,     ///< [rad/s], vehicle axes
  kAccelBias = 12,   ///< [m/s^2], vehicle axes
  kCrossAxisX = 15,  ///< accelerometer cross-axis gain x [1], vehicle axes
  kCrossAxisY = 18,  ///< accelerometer cross-axis gain y [1], vehicle axes
  kRolling = 21,     ///< T_world_rolling * exp(rho, phi) [m, rad], rolling axes
  kMapBias = 27,     ///< prior-map bias [m], world axes
  kWheelScale = 30,  ///< [1]
  kGpsBias = 31,     ///< GPS bias [standard deviations that the receiver reports], world axes
  kRate = 34,        ///< of rate_vehicle [rad/s]; used only without INS
  kMount = 37,       ///< LADAR misalignment [rad], vehicle axes
  kSlip = 40,        ///< [standard deviations], vehicle axes
  kClimbSlip = 43,   ///< [1]
  kSize = 44
};

using ErrorState = Vec<kSize>;
using Cov = Mat<kSize>;

struct NavState {
  Stamp stamp{};  ///< sensor time
  Pose T_world_vehicle;
  Vec3 v_world = Vec3::Zero();     ///< [m/s]
  Vec3 gyro_bias = Vec3::Zero();   ///< [rad/s]
  Vec3 accel_bias = Vec3::Zero();  ///< [m/s^2]
  /// Accelerometer cross-axis gain x: specific force that they measure falsely for each unit of
  /// force along vehicle x, because their axes are neither orthogonal nor aligned with the gyros.
  /// On a slope of 10 deg a gain of 1.5e-3 looks like a vertical acceleration of 2.6 mm/s^2: 1 m
  /// after half a minute. The share of gravity along vehicle z is part of the bias.
  Vec3 cross_axis_x = Vec3::Zero();
  /// Cross-axis gain y: the same for a force along vehicle y, as in a long bend.
  Vec3 cross_axis_y = Vec3::Zero();
  Pose T_world_rolling;          ///< meaningful when map_epoch >= 0
  Vec3 map_bias = Vec3::Zero();  ///< prior-map bias: a priori map minus truth [m], world axes
  double wheel_scale = 1.0;      ///< measured over true speed
  /// GPS bias: time-correlated part of the GPS error, in units of the standard deviation that the
  /// receiver reports. GPS errors (orbits, troposphere, multipath, float ambiguities) last for a
  /// minute: modelled as white, a hundred fixes would make the covariance ten times too small in
  /// sigma. The unit is relative because one receiver reports fixes from 2 cm to 5 m.
  Vec3 gps_bias = Vec3::Zero();
  /// LADAR misalignment: rotation of the LADAR mount against its configuration. It lifts or shifts
  /// the measured path of a straight drive: 3.5 mm per metre for 0.2 deg.
  Vec3 mount = Vec3::Zero();
  /// Wheel slip forward, sideways and off the ground, in units of its standard deviation
  /// (OdometryParams). Slip is time-correlated: modelled as white, twenty samples a second would
  /// make the filter overconfident.
  Vec3 slip = Vec3::Zero();
  /// Additional longitudinal slip as a share of the speed, times the sine of the climb. It does not
  /// average out: too fast uphill and too slow downhill both look like a vehicle that rises.
  double slip_per_climb = 0.0;
  Vec3 rate_vehicle = Vec3::Zero();  ///< [rad/s]; from the gyro while `inertial`, else estimated
  int map_epoch = -1;                ///< of T_world_rolling; -1: none yet
  bool inertial = false;             ///< the last interval was integrated from the INS
};

struct Belief {
  NavState x;
  Cov P = Cov::Zero();
};

/// The state perturbed by an error.
inline NavState boxplus(const NavState& x, const ErrorState& d) {
  NavState y = x;
  y.T_world_vehicle.p += d.segment<3>(kPosition);
  y.T_world_vehicle.q = (x.T_world_vehicle.q * exp_so3(d.segment<3>(kAttitude))).normalized();
  y.v_world += d.segment<3>(kVelocity);
  y.gyro_bias += d.segment<3>(kGyroBias);
  y.accel_bias += d.segment<3>(kAccelBias);
  y.cross_axis_x += d.segment<3>(kCrossAxisX);
  y.cross_axis_y += d.segment<3>(kCrossAxisY);
  y.T_world_rolling = x.T_world_rolling * exp_se3(d.segment<6>(kRolling));
  y.map_bias += d.segment<3>(kMapBias);
  y.wheel_scale += d[kWheelScale];
  y.gps_bias += d.segment<3>(kGpsBias);
  y.rate_vehicle += d.segment<3>(kRate);
  y.mount += d.segment<3>(kMount);
  y.slip += d.segment<3>(kSlip);
  y.slip_per_climb += d[kClimbSlip];
  return y;
}

/// The error that takes x to y: boxplus(x, boxminus(y, x)) == y.
inline ErrorState boxminus(const NavState& y, const NavState& x) {
  ErrorState d;
  d.segment<3>(kPosition) = y.T_world_vehicle.p - x.T_world_vehicle.p;
  d.segment<3>(kVelocity) = y.v_world - x.v_world;
  d.segment<3>(kAttitude) = log_so3(x.T_world_vehicle.q.conjugate() * y.T_world_vehicle.q);
  d.segment<3>(kGyroBias) = y.gyro_bias - x.gyro_bias;
  d.segment<3>(kAccelBias) = y.accel_bias - x.accel_bias;
  d.segment<3>(kCrossAxisX) = y.cross_axis_x - x.cross_axis_x;
  d.segment<3>(kCrossAxisY) = y.cross_axis_y - x.cross_axis_y;
  d.segment<6>(kRolling) = log_se3(x.T_world_rolling.inverse() * y.T_world_rolling);
  d.segment<3>(kMapBias) = y.map_bias - x.map_bias;
  d[kWheelScale] = y.wheel_scale - x.wheel_scale;
  d.segment<3>(kGpsBias) = y.gps_bias - x.gps_bias;
  d.segment<3>(kRate) = y.rate_vehicle - x.rate_vehicle;
  d.segment<3>(kMount) = y.mount - x.mount;
  d.segment<3>(kSlip) = y.slip - x.slip;
  d[kClimbSlip] = y.slip_per_climb - x.slip_per_climb;
  return d;
}

/// The vehicle pose as derived from the LADAR with its configured mount. The misalignment is
/// modelled as a rotation about the origin of the vehicle instead of the LADAR, a difference of
/// millimetres.
inline Pose T_world_seen(const NavState& x) {
  return x.T_world_vehicle * Pose{exp_so3(x.mount), Vec3::Zero()};
}

/// The same in the rolling map of SP.
inline Pose T_rolling_vehicle(const NavState& x) {
  return x.T_world_rolling.inverse() * T_world_seen(x);
}

/// Jacobian of the right perturbation (rho, phi) of T_world_vehicle by the error state.
[[nodiscard]] Mat<6, kSize> world_pose_jacobian(const NavState& x);

/// The same of T_world_seen.
[[nodiscard]] Mat<6, kSize> seen_pose_jacobian(const NavState& x);

/// The same of T_rolling_vehicle.
[[nodiscard]] Mat<6, kSize> rolling_pose_jacobian(const NavState& x);

/// Covariances of the right perturbations (rho [m, vehicle axes], phi [rad]).
/// @param ins_mount_rad  sigma of the mounting angles of the INS, which its attitude does not
///   contain
[[nodiscard]] Mat6 world_pose_covariance(const Belief& b, double ins_mount_rad);
[[nodiscard]] Mat6 rolling_pose_covariance(const Belief& b);

}  // namespace rcs::wm

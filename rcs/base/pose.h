#pragma once
// Rigid motions, SE(3). T_a_b maps coordinates in frame b to frame a: p_a = T_a_b * p_b.

#include "rcs/base/linear.h"

namespace rcs {

/// A rigid motion. Perturbations are 6-vectors (rho [m], phi [rad]) applied on the right:
/// T_a_b * exp(xi) moves frame b by xi, expressed in b.
struct Pose {
  Quat q = Quat::Identity();
  Vec3 p = Vec3::Zero();

  Vec3 operator*(const Vec3& point) const { return q * point + p; }

  Pose operator*(const Pose& other) const {
    // Normalizing each product keeps |q| = 1 within rounding.
    return {(q * other.q).normalized(), q * other.p + p};
  }

  [[nodiscard]] Pose inverse() const {
    const Quat qi = q.conjugate();
    return {qi, -(qi * p)};
  }

  [[nodiscard]] Mat3 rotation() const { return q.toRotationMatrix(); }

  [[nodiscard]] Eigen::Matrix4d matrix() const {
    Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
    m.topLeftCorner<3, 3>() = rotation();
    m.topRightCorner<3, 1>() = p;
    return m;
  }

  [[nodiscard]] bool finite() const { return q.coeffs().allFinite() && p.allFinite(); }
};

/// SE(3) exponential of (rho, phi) [m, rad].
inline Pose exp_se3(const Vec6& xi) {
  const Vec3 phi = xi.tail<3>();
  // The left Jacobian of phi is the right Jacobian of -phi.
  return {exp_so3(phi), right_jacobian_so3(-phi) * xi.head<3>()};
}

/// SE(3) logarithm (rho, phi) [m, rad]; |phi| <= pi.
inline Vec6 log_se3(const Pose& T) {
  Vec6 xi;
  const Vec3 phi = log_so3(T.q);
  xi.tail<3>() = phi;
  xi.head<3>() = right_jacobian_inverse_so3(-phi) * T.p;
  return xi;
}

/// Adjoint: T * exp(xi) = exp(adjoint(T) * xi) * T.
inline Mat6 adjoint(const Pose& T) {
  const Mat3 R = T.rotation();
  Mat6 a = Mat6::Zero();
  a.topLeftCorner<3, 3>() = R;
  a.bottomRightCorner<3, 3>() = R;
  a.topRightCorner<3, 3>() = hat(T.p) * R;
  return a;
}

/// The pose at fraction s in [0, 1] of the screw motion from a to b.
inline Pose interpolate(const Pose& a, const Pose& b, double s) {
  return a * exp_se3(s * log_se3(a.inverse() * b));
}

/// Yaw (heading) of a rotation world <- vehicle: counter-clockwise from the x axis [rad].
inline double yaw_of(const Quat& q) {
  return std::atan2(2.0 * (q.w() * q.z() + q.x() * q.y()),
                    1.0 - 2.0 * (q.y() * q.y() + q.z() * q.z()));
}

}  // namespace rcs

#pragma once
// Fixed-size linear algebra names, and the small SO(3) functions that every estimator needs.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

namespace rcs {

template <int N>
using Vec = Eigen::Matrix<double, N, 1>;
template <int R, int C = R>
using Mat = Eigen::Matrix<double, R, C>;

using Vec2 = Vec<2>;
using Vec3 = Vec<3>;
using Vec6 = Vec<6>;
using Mat3 = Mat<3>;
using Mat6 = Mat<6>;
using Quat = Eigen::Quaterniond;
using Vec3f = Eigen::Vector3f;
using Mat3f = Eigen::Matrix3f;

constexpr double kPi = 3.14159265358979323846;
constexpr double radians(double deg) { return deg * (kPi / 180.0); }
constexpr double degrees(double rad) { return rad * (180.0 / kPi); }

/// Wraps to (-pi, pi].
inline double wrap_angle(double a_rad) {
  const double w = std::remainder(a_rad, 2.0 * kPi);
  return w <= -kPi ? w + 2.0 * kPi : w;
}

/// The matrix of the cross product: hat(a) * b = a x b.
inline Mat3 hat(const Vec3& a) {
  Mat3 m;
  m << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0;
  return m;
}

/// SO(3) exponential as a unit quaternion; exact to double precision for any |phi| [rad].
inline Quat exp_so3(const Vec3& phi) {
  const double angle2 = phi.squaredNorm();
  const double angle = std::sqrt(angle2);
  // sin(a/2)/a, by its series where the quotient would lose digits.
  const double s = angle < 1e-4 ? 0.5 - angle2 / 48.0 : std::sin(0.5 * angle) / angle;
  return Quat(std::cos(0.5 * angle), s * phi.x(), s * phi.y(), s * phi.z());
}

/// SO(3) logarithm: the rotation vector [rad], |phi| <= pi.
inline Vec3 log_so3(const Quat& q) {
  const double sign = q.w() < 0.0 ? -1.0 : 1.0;  // q and -q are one rotation: use the shorter
  const Vec3 v = sign * q.vec();
  const double n = v.norm();
  const double w = sign * q.w();
  const double k = n < 1e-9 ? 2.0 / w : 2.0 * std::atan2(n, w) / n;
  return k * v;
}

/// Right Jacobian of SO(3): exp(phi + d) = exp(phi) * exp(Jr(phi) * d) to first order in d.
inline Mat3 right_jacobian_so3(const Vec3& phi) {
  const double t2 = phi.squaredNorm();
  const double t = std::sqrt(t2);
  const Mat3 h = hat(phi);
  const double a = t < 1e-3 ? 0.5 - t2 / 24.0 : (1.0 - std::cos(t)) / t2;
  const double b = t < 1e-3 ? 1.0 / 6.0 - t2 / 120.0 : (t - std::sin(t)) / (t2 * t);
  return Mat3::Identity() - a * h + b * h * h;
}

/// Inverse of right_jacobian_so3; |phi| < 2 pi.
inline Mat3 right_jacobian_inverse_so3(const Vec3& phi) {
  const double t2 = phi.squaredNorm();
  const double t = std::sqrt(t2);
  const Mat3 h = hat(phi);
  const double c =
      t < 1e-3 ? 1.0 / 12.0 + t2 / 720.0 : 1.0 / t2 - (1.0 + std::cos(t)) / (2.0 * t * std::sin(t));
  return Mat3::Identity() + 0.5 * h + c * h * h;
}

}  // namespace rcs

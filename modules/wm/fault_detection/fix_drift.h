// Fixes that drift: a velocity relative to the filter that no wrong heading explains.
#pragma once

#include "rcs/base/linear.h"

namespace rcs::wm {

/// Least squares over the velocities of fixes relative to the filter,
///     v_fix - v_filter = psi k x v_filter + drift + noise,
/// with the error psi of the heading of the filter and a constant drift, in the horizontal plane.
/// Along a straight the drift across it is as uncertain as the heading; along the motion, and on
/// bends, it is not.
class FixDrift {
 public:
  /// @param off_mps    velocity of the fix, less that of the filter
  /// @param v_mps      velocity of the filter
  /// @param sigma_mps  of the fix
  void add(const Vec2& off_mps, const Vec2& v_mps, double sigma_mps);

  /// Squared Mahalanobis distance of the drift from zero (chi-square, 2 dof); 0 without a fix.
  /// @param heading_rad  standard deviation of psi, above 0
  /// @param own          covariance of the velocity of the filter, common to all fixes [m^2/s^2]
  [[nodiscard]] double squared_mahalanobis(double heading_rad, const Mat<2, 2>& own) const;

 private:
  Mat3 information_ = Mat3::Zero();  ///< of psi and the drift
  Vec3 weighted_ = Vec3::Zero();
};

}  // namespace rcs::wm

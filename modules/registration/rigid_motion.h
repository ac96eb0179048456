#pragma once
// The motion between two sets of corresponding points, in closed form.

#include "rcs/base/pose.h"

namespace rcs::registration {

/// Sums over pairs (p, q): centroids and cross-covariance. Coordinates are relative to the first
/// pair, which avoids cancellation far from the origin.
class PointPairMoments {
 public:
  void add(const Vec3& p, const Vec3& q, double weight = 1.0);

  [[nodiscard]] int pairs() const { return pairs_; }
  [[nodiscard]] Vec3 p_centroid() const { return p0_ + p_ / weight_; }
  [[nodiscard]] Vec3 q_centroid() const { return q0_ + q_ / weight_; }
  /// sum w (p - p_c)(q - q_c)^T, the paper's H; divided by the sum of the weights [m^2].
  [[nodiscard]] Mat3 cross_covariance() const {
    return pq_ / weight_ - (p_ / weight_) * (q_ / weight_).transpose();
  }

 private:
  int pairs_ = 0;
  double weight_ = 0.0;
  Vec3 p0_ = Vec3::Zero();
  Vec3 q0_ = Vec3::Zero();
  Vec3 p_ = Vec3::Zero();
  Vec3 q_ = Vec3::Zero();
  Mat3 pq_ = Mat3::Zero();
};

struct RigidMotion {
  Mat3 R = Mat3::Identity();  ///< q = R p + T
  Vec3 T = Vec3::Zero();
  bool reflection = false;  ///< R is no rotation: its determinant is -1 (only if not guarded)
  bool degenerate = false;  ///< the pairs lie on a line or in a point: R is not unique
};

/// Least squares by singular values (Arun, Huang & Blostein 1987; the paper's step 2).
/// @param guard_reflection  Umeyama's (1991) sign: without it, planar or noisy pairs can give a
///   reflection
[[nodiscard]] RigidMotion motion_by_svd(const PointPairMoments& sums, bool guard_reflection = true);

/// The same least squares by unit quaternions (Horn 1987); never a reflection.
[[nodiscard]] RigidMotion motion_by_quaternion(const PointPairMoments& sums);

}  // namespace rcs::registration

#include "modules/registration/rigid_motion.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>

#include "rcs/base/check.h"

namespace rcs::registration {
namespace {

// The second singular value over the first, below which the pairs lie on a line.
constexpr double kLine = 1e-9;

}  // namespace

void PointPairMoments::add(const Vec3& p, const Vec3& q, double weight) {
  if (pairs_++ == 0) {
    p0_ = p;
    q0_ = q;
  }
  const Vec3 dp = p - p0_;
  const Vec3 dq = q - q0_;
  weight_ += weight;
  p_ += weight * dp;
  q_ += weight * dq;
  pq_ += weight * dp * dq.transpose();
}

RigidMotion motion_by_svd(const PointPairMoments& sums, bool guard_reflection) {
  RCS_CHECK(sums.pairs() > 0);
  const Eigen::JacobiSVD<Mat3> svd(sums.cross_covariance(),
                                   Eigen::ComputeFullU | Eigen::ComputeFullV);
  RigidMotion out;
  const double sign = (svd.matrixV() * svd.matrixU().transpose()).determinant() < 0.0 ? -1.0 : 1.0;
  out.reflection = sign < 0.0 && !guard_reflection;
  const Vec3 guard(1.0, 1.0, guard_reflection ? sign : 1.0);
  out.R = svd.matrixV() * guard.asDiagonal() * svd.matrixU().transpose();
  out.T = sums.q_centroid() - out.R * sums.p_centroid();
  out.degenerate = svd.singularValues()[1] <= kLine * svd.singularValues()[0];
  return out;
}

RigidMotion motion_by_quaternion(const PointPairMoments& sums) {
  RCS_CHECK(sums.pairs() > 0);
  const Mat3 S = sums.cross_covariance();
  // Horn's 4 x 4 matrix: its eigenvector of the largest eigenvalue is the rotation (w, x, y, z).
  Eigen::Matrix4d N;
  N(0, 0) = S.trace();
  N.block<1, 3>(0, 1) << S(1, 2) - S(2, 1), S(2, 0) - S(0, 2), S(0, 1) - S(1, 0);
  N.block<3, 1>(1, 0) = N.block<1, 3>(0, 1).transpose();
  N.block<3, 3>(1, 1) = S + S.transpose() - S.trace() * Mat3::Identity();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(N);
  const Eigen::Vector4d q = eigen.eigenvectors().col(3);
  RigidMotion out;
  out.R = Quat(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  out.T = sums.q_centroid() - out.R * sums.p_centroid();
  // For a line the two largest eigenvalues are the same.
  const Eigen::Vector4d& lambda = eigen.eigenvalues();
  out.degenerate = lambda[3] - lambda[2] <= kLine * std::max(lambda[3], -lambda[0]);
  return out;
}

}  // namespace rcs::registration

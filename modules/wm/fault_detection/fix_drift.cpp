#include "modules/wm/fault_detection/fix_drift.h"

#include <Eigen/Dense>

namespace rcs::wm {

void FixDrift::add(const Vec2& off_mps, const Vec2& v_mps, double sigma_mps) {
  Mat<2, 3> H;
  H << -v_mps.y(), 1.0, 0.0,  //
      v_mps.x(), 0.0, 1.0;
  const double weight = 1.0 / (sigma_mps * sigma_mps);
  information_ += weight * H.transpose() * H;
  weighted_ += weight * H.transpose() * off_mps;
}

double FixDrift::squared_mahalanobis(double heading_rad, const Mat<2, 2>& own) const {
  if (information_(1, 1) == 0.0) return 0.0;
  Mat3 A = information_;
  A(0, 0) += 1.0 / (heading_rad * heading_rad);
  const Eigen::LDLT<Mat3> solver(A);
  const Vec2 drift = solver.solve(weighted_).tail<2>();
  const Mat3 covariance = solver.solve(Mat3::Identity());
  const Mat<2, 2> S = covariance.bottomRightCorner<2, 2>() + own;
  return drift.dot(S.llt().solve(drift));
}

}  // namespace rcs::wm

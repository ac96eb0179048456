#pragma once
// The mean of the newest residuals of one pose, measured by scans.

#include "rcs/base/linear.h"
#include "rcs/base/pose.h"

namespace rcs::wm {

/// Residuals and covariances are those of a pose: (rho [m], phi [rad]) in the axes of the vehicle,
/// which turns meanwhile. The mean is formed in the axes of the map, where a displacement keeps its
/// direction, and for each axis on its own, weighted by the information about it: a scan that does
/// not observe an axis hardly counts there. The least-squares mean of vectors that differ would
/// make a rotation of a displacement that grows, where the scans observe only a combination of
/// both.
class MatchMean {
 public:
  static constexpr int kMatches = 10;  ///< time constant

  void add(const Quat& q_map_vehicle, const Vec6& residual, const Mat6& covariance) {
    constexpr double kKept = 1.0 - 1.0 / kMatches;
    const Mat6 to_map = rotation(q_map_vehicle);
    const Mat6 weight = to_map * covariance.llt().solve(Mat6(to_map.transpose()));
    information_ = kKept * information_ + weight;
    weighted_ = kKept * weighted_ + weight.diagonal().cwiseProduct(to_map * residual);
    ++count_;
  }

  [[nodiscard]] int count() const { return count_; }
  /// @pre count() > 0
  [[nodiscard]] Vec6 mean(const Quat& q_map_vehicle) const {
    return rotation(q_map_vehicle).transpose() * weighted_.cwiseQuotient(information_.diagonal());
  }
  /// Of independent residuals of one value. @pre count() > 0
  [[nodiscard]] Mat6 covariance(const Quat& q_map_vehicle) const {
    const Mat6 to_map = rotation(q_map_vehicle);
    return to_map.transpose() * information_.llt().solve(to_map);
  }

 private:
  static Mat6 rotation(const Quat& q) {
    Mat6 both = Mat6::Zero();
    both.topLeftCorner<3, 3>() = both.bottomRightCorner<3, 3>() = q.toRotationMatrix();
    return both;
  }

  Mat6 information_ = Mat6::Zero();  // axes of the map, with decreasing weights
  Vec6 weighted_ = Vec6::Zero();
  int count_ = 0;
};

}  // namespace rcs::wm

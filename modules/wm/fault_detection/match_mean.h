#pragma once
// The mean of the newest residuals of one pose, measured by scans.

#include "rcs/base/linear.h"
#include "rcs/base/pose.h"

namespace rcs::wm {

/// Residuals and covariances are those of a pose: (rho [m], phi [rad]) in the axes of the vehicle,
/// which turns meanwhile. The mean is formed in the axes of the map, where a displacement keeps its
/// direction, and for each axis on its own, weighted by the variance of that axis: a scan that does
/// not observe an axis hardly counts there. The least-squares mean of vectors that differ would
/// make a rotation of a displacement that grows, where the scans observe only a combination of
/// both.
class MatchMean {
 public:
  static constexpr int kMatches = 10;  ///< time constant

  void add(const Quat& q_map_vehicle, const Vec6& residual, const Mat6& covariance) {
    constexpr double kKept = 1.0 - 1.0 / kMatches;
    const Mat6 to_map = rotation(q_map_vehicle);
    const Mat6 in_map = to_map * covariance * to_map.transpose();
    const Vec6 weight = in_map.diagonal().cwiseInverse();
    weight_ = kKept * weight_ + weight;
    weighted_ = kKept * weighted_ + weight.cwiseProduct(to_map * residual);
    spread_ = kKept * spread_ + weight.asDiagonal() * in_map * weight.asDiagonal();
    ++count_;
  }

  [[nodiscard]] int count() const { return count_; }
  /// @pre count() > 0
  [[nodiscard]] Vec6 mean(const Quat& q_map_vehicle) const {
    return rotation(q_map_vehicle).transpose() * weighted_.cwiseQuotient(weight_);
  }
  /// That of the mean of kMatches independent residuals; as their errors are not quite independent,
  /// not that of all. @pre count() > 0
  [[nodiscard]] Mat6 covariance(const Quat& q_map_vehicle) const {
    const Mat6 to_map = rotation(q_map_vehicle);
    const Vec6 share = weight_.cwiseInverse();
    return to_map.transpose() * share.asDiagonal() * spread_ * share.asDiagonal() * to_map;
  }

 private:
  static Mat6 rotation(const Quat& q) {
    Mat6 both = Mat6::Zero();
    both.topLeftCorner<3, 3>() = both.bottomRightCorner<3, 3>() = q.toRotationMatrix();
    return both;
  }

  Vec6 weight_ = Vec6::Zero();  // axes of the map, with decreasing weights, as the next two
  Vec6 weighted_ = Vec6::Zero();
  Mat6 spread_ = Mat6::Zero();
  int count_ = 0;
};

}  // namespace rcs::wm

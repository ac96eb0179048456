#pragma once
// Exchanged or inverted axes of the gyro, by the rotation that the LADAR measures.

#include <algorithm>

#include "rcs/base/linear.h"

namespace rcs::wm {

/// Correlates the rotations from scan to scan by gyro and by LADAR, rotation vectors [rad] in the
/// axes of the vehicle. About an axis the gyro is wrong if another one of its axes, or the inverted
/// one, explains the rotation by the LADAR much better than it does, and most of that rotation. The
/// noise of the LADAR need not be known: noise does not correlate with another axis.
class GyroAxes {
 public:
  void add(const Vec3& by_gyro, const Vec3& by_ladar) {
    constexpr double kKept = 1.0 - 1.0 / kScans;
    product_ = kKept * product_ + by_ladar * by_gyro.transpose();
    gyro_ = kKept * gyro_ + by_gyro.cwiseAbs2();
    ladar_ = kKept * ladar_ + by_ladar.cwiseAbs2();
    if (count_ < kScans) ++count_;
  }

  [[nodiscard]] bool wrong() const {
    if (count_ < kScans) return false;
    for (int axis = 0; axis < 3; ++axis) {
      if (ladar_[axis] < kScans * kLeast_rad * kLeast_rad) continue;
      const double limit = kMuchBetter * std::min(ladar_[axis], unexplained(axis, axis, 1.0));
      for (int other = 0; other < 3; ++other) {
        if (unexplained(axis, other, -1.0) < limit) return true;
        if (other != axis && unexplained(axis, other, 1.0) < limit) return true;
      }
    }
    return false;
  }

 private:
  static constexpr int kScans = 20;  // time constant
  static constexpr double kMuchBetter = 0.3;
  static constexpr double kLeast_rad = 5e-4;  // from scan to scan; less is rounding, not motion

  /// Of the rotation by the LADAR about one axis, by one axis of the gyro: sum of squares [rad^2].
  [[nodiscard]] double unexplained(int ladar_axis, int gyro_axis, double sign) const {
    return ladar_[ladar_axis] + gyro_[gyro_axis] - 2.0 * sign * product_(ladar_axis, gyro_axis);
  }

  Mat3 product_ = Mat3::Zero();  // rows: LADAR, columns: gyro; decreasing weights, as the next two
  Vec3 gyro_ = Vec3::Zero();
  Vec3 ladar_ = Vec3::Zero();
  int count_ = 0;
};

}  // namespace rcs::wm

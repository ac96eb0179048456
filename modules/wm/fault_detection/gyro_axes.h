#pragma once
// Exchanged or inverted axes of the gyro, and a gyro that is not confirmed, by the rotation that
// the LADAR measures.

#include <algorithm>
#include <cmath>

#include "rcs/base/linear.h"

namespace rcs::wm {

/// Correlates the rotations from scan to scan by gyro and by LADAR, rotation vectors [rad] in the
/// axes of the vehicle. About an axis the gyro is wrong if another one of its axes, or the inverted
/// one, explains the rotation by the LADAR much better than it does, and most of that rotation. The
/// noise of the LADAR need not be known: noise does not correlate with another axis.
class GyroAxes {
 public:
  void add(const Vec3& by_gyro, const Vec3& by_ladar) {
    long_.add(by_gyro, by_ladar, kScans);
    recent_.add(by_gyro, by_ladar, kRecentScans);
    if (count_ < kScans) ++count_;
  }

  [[nodiscard]] bool wrong() const {
    if (count_ < kScans) return false;
    for (int axis = 0; axis < 3; ++axis) {
      const double ladar = long_.ladar[axis];
      if (ladar < kScans * kMin_rad * kMin_rad) continue;
      const double limit = kMuchBetter * std::min(ladar, unexplained(axis, axis, 1.0));
      for (int other = 0; other < 3; ++other) {
        if (unexplained(axis, other, -1.0) < limit) return true;
        if (other != axis && unexplained(axis, other, 1.0) < limit) return true;
      }
    }
    return false;
  }

  /// The gyro rolls or pitches much, and the LADAR not with it. A wrong gyro distorts the scans
  /// that are deskewed with it, and the LADAR then measures noise: not enough to exclude a gyro,
  /// but nothing that confirms it.
  [[nodiscard]] bool unconfirmed() const {
    for (int axis = 0; axis < 2; ++axis) {
      const double gyro = recent_.gyro[axis];
      if (gyro < kRecentScans * kMotion_rad * kMotion_rad) continue;
      const double both = std::sqrt(gyro * recent_.ladar[axis]);
      if (recent_.product(axis, axis) < kCorrelated * both) return true;
    }
    return false;
  }

 private:
  static constexpr int kScans = 20;  // time constants
  static constexpr int kRecentScans = 8;
  static constexpr double kMuchBetter = 0.3;
  static constexpr double kMin_rad = 5e-4;  // from scan to scan; less is rounding, not motion
  static constexpr double kMotion_rad = 5e-3;
  static constexpr double kCorrelated = 0.3;

  /// Sums of squares and products with decreasing weights [rad^2].
  struct Sums {
    Mat3 product = Mat3::Zero();  // rows: LADAR, columns: gyro
    Vec3 gyro = Vec3::Zero();
    Vec3 ladar = Vec3::Zero();

    void add(const Vec3& by_gyro, const Vec3& by_ladar, int scans) {
      const double keep = 1.0 - 1.0 / scans;
      product = keep * product + by_ladar * by_gyro.transpose();
      gyro = keep * gyro + by_gyro.cwiseAbs2();
      ladar = keep * ladar + by_ladar.cwiseAbs2();
    }
  };

  /// Of the rotation by the LADAR about one axis, by one axis of the gyro: sum of squares [rad^2].
  [[nodiscard]] double unexplained(int ladar_axis, int gyro_axis, double sign) const {
    return long_.ladar[ladar_axis] + long_.gyro[gyro_axis] -
           2.0 * sign * long_.product(ladar_axis, gyro_axis);
  }

  Sums long_;
  Sums recent_;
  int count_ = 0;
};

}  // namespace rcs::wm

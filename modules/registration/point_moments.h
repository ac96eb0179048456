#pragma once
// Count, mean and scatter of points: the content of a voxel.

#include <array>

#include "rcs/base/linear.h"

namespace rcs::registration {

struct Moments {
  float count = 0.0F;
  Vec3f mean = Vec3f::Zero();
  std::array<float, 6> scatter{};  ///< sum of (p - mean)(p - mean)^T: xx xy xz yy yz zz

  /// Welford: one pass, no cancellation.
  void add(const Vec3f& p) {
    count += 1.0F;
    const Vec3f d = p - mean;
    mean += d / count;
    add_product(d, p - mean, 1.0F);
  }

  /// Chan, Golub & LeVeque 1983.
  /// @param shift  from the origin of this frame to that of `other`
  void add(const Moments& other, const Vec3f& shift) {
    const float total = count + other.count;
    const Vec3f d = other.mean + shift - mean;
    for (std::size_t k = 0; k < scatter.size(); ++k) scatter[k] += other.scatter[k];
    add_product(d, d, count * other.count / total);
    mean += d * (other.count / total);
    count = total;
  }

  /// At least two points.
  [[nodiscard]] Mat3f covariance() const {
    Mat3f c;
    c << scatter[0], scatter[1], scatter[2],  //
        scatter[1], scatter[3], scatter[4],   //
        scatter[2], scatter[4], scatter[5];
    return c / (count - 1.0F);
  }

 private:
  void add_product(const Vec3f& a, const Vec3f& b, float weight) {
    scatter[0] += weight * a.x() * b.x();
    scatter[1] += weight * a.x() * b.y();
    scatter[2] += weight * a.x() * b.z();
    scatter[3] += weight * a.y() * b.y();
    scatter[4] += weight * a.y() * b.z();
    scatter[5] += weight * a.z() * b.z();
  }
};

}  // namespace rcs::registration

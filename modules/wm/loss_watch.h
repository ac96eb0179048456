#pragma once
// Detects a solution that no ground vehicle can have. With a wrong attitude gravity becomes an
// acceleration: the velocity then grows until every measurement fails its gate, and no source can
// correct the filter any more.

#include "rcs/base/linear.h"
#include "rcs/base/stamp.h"

namespace rcs::wm {

class LossWatch {
 public:
  /// @param v_vehicle    estimated velocity [m/s], vehicle axes
  /// @param constrained  the vehicle moves along its own axis: wheels or tracks
  /// @return whether the velocity has been impossible for so long that the solution is lost
  bool add(Stamp stamp, const Vec3& v_vehicle, bool constrained) {
    const double across_mps = v_vehicle.tail<2>().norm();
    // Written so that NaN is impossible.
    const bool possible =
        v_vehicle.norm() < kFastest_mps && (!constrained || across_mps < kAcross_mps);
    if (possible || stamp < since_) since_ = stamp;
    return stamp - since_ >= kFor;
  }
  void clear() { since_ = Stamp::max(); }

 private:
  static constexpr Duration kFor = from_seconds(2.0);
  static constexpr double kFastest_mps = 80.0;
  static constexpr double kAcross_mps = 5.0;  ///< a slide or a fall is shorter than kFor

  Stamp since_ = Stamp::max();  ///< possible until then
};

}  // namespace rcs::wm

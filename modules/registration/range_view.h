#pragma once
// What a scan saw, by direction: to find points that lie in space that its beams passed through.

#include <vector>

#include "rcs/base/points.h"

namespace rcs::registration {

/// Shortest range of a scan in each direction cell of about 1.5 deg.
class RangeView {
 public:
  /// @param points_sensor  [m], finite, from one position, which is the origin
  explicit RangeView(const Points& points_sensor);

  /// True if all returns of the scan in the direction of `p` are clearly behind it: the scan would
  /// have seen something there. False where it has no return.
  [[nodiscard]] bool passed_through(const Vec3f& p_sensor) const;

 private:
  std::vector<float> nearest_m_;  // by cell; 0: no return
};

}  // namespace rcs::registration

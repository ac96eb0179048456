#pragma once
// Facets of ranges as points, by the calibration of the LADAR.

#include <optional>

#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "modules/sp/scan/range_image.h"
#include "rcs/ros2/point_clouds.h"

namespace rcs::mcap {

/// All returns of a facet within the range limits of the LADAR, in the frame of its mount at pan =
/// tilt = 0, each with its time and its row. Mixed pixels are included: this is what was measured.
class FacetPoints {
 public:
  explicit FacetPoints(const sp::LadarParams& ladar);

  /// nullopt: the facet is not of this LADAR
  [[nodiscard]] std::optional<ros2::CloudPart> operator()(const ladar_ranges_t& m) const;

 private:
  sp::Calibration calibration_;
};

}  // namespace rcs::mcap

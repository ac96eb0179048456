#pragma once
// What of a scan is matched to the a priori map: the lowest point of each column, and some of what
// stands on the ground.

#include <cstddef>

#include "modules/registration/voxel_sampler.h"
#include "modules/sp/scan/column_sampler.h"
#include "rcs/base/linear.h"
#include "rcs/base/points.h"

namespace rcs::sp {

struct PriorScanParams {
  double column_m = 2.0;    ///< the lowest point of such a column is the ground's
  double standing_m = 0.5;  ///< what is so much higher than that stands on the ground
  double voxel_m = 0.25;    ///< one point a voxel of that
};

class PriorScan {
 public:
  /// Makes room for scans of so many points beforehand.
  void reserve(std::size_t points);

  /// @param scan  vehicle frame [m]
  /// @param up_vehicle  unit vector
  /// @param most_standing  points of what stands, spread over the scan; 0: none
  void take(const Points& scan, const Vec3& up_vehicle, int most_standing,
            const PriorScanParams& params);

  [[nodiscard]] const Points& ground() const { return ground_; }
  [[nodiscard]] const Points& standing() const { return standing_; }

 private:
  ColumnSampler columns_;
  registration::VoxelSampler voxels_;
  Points ground_;
  Points all_standing_;
  Points standing_;
};

}  // namespace rcs::sp

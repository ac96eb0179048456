#pragma once
// The points of a scan that are matched to the a priori map: the lowest point of each column, and
// some points of above-ground structure.

#include <cstddef>

#include "modules/registration/voxel_sampler.h"
#include "modules/sp/scan/column_sampler.h"
#include "rcs/base/linear.h"
#include "rcs/base/points.h"

namespace rcs::sp {

struct PriorScanParams {
  double column_m = 2.0;    ///< the lowest point of such a column is ground
  double standing_m = 0.5;  ///< a point higher above that is above-ground structure
  double voxel_m = 0.25;    ///< one above-ground point is kept in each voxel
};

class PriorScan {
 public:
  /// Allocates room for scans of `points` points in advance.
  void reserve(std::size_t points);

  /// @param scan  vehicle frame [m]
  /// @param up_vehicle  unit vector
  /// @param max_standing  points of above-ground structure, spread over the scan; 0: none
  void take(const Points& scan, const Vec3& up_vehicle, int max_standing,
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

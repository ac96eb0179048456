#pragma once
// Downsampling of a point cloud.

#include <cstddef>

#include "modules/registration/voxel_table.h"
#include "rcs/base/points.h"

namespace rcs::registration {

/// Leaves at most so many points, spread over all of them in their order.
void keep_evenly(std::size_t most, Points* points);

/// Keeps one point a voxel: the first in scan order. Deterministic; the table is reused, so that it
/// allocates nothing once it has seen a scan as large.
class VoxelSampler {
 public:
  void sample(const Points& in, double voxel_m, Points* out);

  /// Makes room for scans of so many points beforehand.
  void reserve(std::size_t points) { table_.reserve(points); }

 private:
  struct Taken {};
  ScanTable<Taken> table_;
};

}  // namespace rcs::registration

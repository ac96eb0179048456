#pragma once
// Downsampling of a point cloud.

#include <cstddef>

#include "modules/registration/voxel_table.h"
#include "rcs/base/points.h"

namespace rcs::registration {

/// Reduces the points to at most `most`, spread over all of them in their order.
void keep_evenly(std::size_t most, Points* points);

/// Every n-th point, n odd, so that approximately `wanted` (at least 1) remain.
[[nodiscard]] Points thinned(const Points& points, int wanted);

/// Keeps one point of each voxel: the first in scan order. Deterministic; the table is reused: no
/// allocation once it has held a scan as large.
class VoxelSampler {
 public:
  void sample(const Points& in, double voxel_m, Points* out);

  /// Allocates room for scans of `points` points in advance.
  void reserve(std::size_t points) { table_.reserve(points); }

 private:
  struct Taken {};
  ScanTable<Taken> table_;
};

}  // namespace rcs::registration

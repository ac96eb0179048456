#pragma once
// The ground among a scan's points: the lowest point of each vertical column.

#include <cstdint>

#include "modules/registration/voxel_table.h"
#include "rcs/base/linear.h"
#include "rcs/base/points.h"

namespace rcs::sp {

/// Keeps the lowest point of each vertical column, which excludes above-ground points.
/// Deterministic (the first of equal ones); no allocation once it has held a scan as large.
class ColumnSampler {
 public:
  /// @param up_vehicle  unit vector
  void sample(const Points& in, const Vec3& up_vehicle, double column_m, Points* out);

  /// After sample(), of the same points: those higher than the lowest of their column by more than
  /// `above_m`, which are above-ground structure.
  void standing(const Points& in, double above_m, Points* out);

  /// Allocates room for scans of `points` points in advance.
  void reserve(std::size_t points) { table_.reserve(points); }

 private:
  struct Lowest {
    std::uint32_t kept = 0;  // index in the output
    float height_m = 0.0F;
  };
  registration::ScanTable<Lowest> table_;
  Mat3f level_ = Mat3f::Identity();
  float per_m_ = 1.0F;
};

}  // namespace rcs::sp

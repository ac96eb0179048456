#pragma once
// The ground among a scan's points: the lowest point of each vertical column.

#include <cstdint>

#include "modules/registration/voxel_table.h"
#include "rcs/base/linear.h"
#include "rcs/base/points.h"

namespace rcs::sp {

/// Keeps the lowest point of each vertical column: what stands on the ground is not the ground.
/// Deterministic (of equal ones the first); allocates nothing once it has seen a scan as large.
class ColumnSampler {
 public:
  /// @param up_vehicle  unit vector
  void sample(const Points& in, const Vec3& up_vehicle, double column_m, Points* out);

  /// After sample(), of the same points: those that are higher than the lowest of their column by
  /// more than so much, which stand on the ground.
  void standing(const Points& in, double above_m, Points* out);

  /// Makes room for scans of so many points beforehand.
  void reserve(std::size_t points) { table_.reserve(points); }

 private:
  struct Lowest {
    std::uint32_t kept = 0;  // where in the output
    float height_m = 0.0F;
  };
  registration::ScanTable<Lowest> table_;
  Mat3f level_ = Mat3f::Identity();
  float per_m_ = 1.0F;
};

}  // namespace rcs::sp

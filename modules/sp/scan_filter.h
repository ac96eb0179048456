#pragma once
// Deskew and downsampling of a scan.

#include <cstdint>

#include "modules/sp/motion.h"
#include "modules/sp/scan.h"
#include "modules/sp/scan_table.h"

namespace rcs::sp {

/// Moves every point to the reference instant: p <- T_reference_vehicle(dt) * p, linear between
/// the table's knots. All dt must lie inside the table.
void deskew(const MotionTable& motion, Scan* scan);

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
  ScanTable<Lowest> table_;
  Mat3f level_ = Mat3f::Identity();
  float per_m_ = 1.0F;
};

}  // namespace rcs::sp

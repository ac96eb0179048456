#pragma once
// The ground observed on the last stretch of the path: one height for each cell.

#include <cstdint>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::sp {

struct GroundPatchParams {
  double cell_m = 2.0;    ///< one height each
  double reach_m = 40.0;  ///< around the vehicle; a tilted scan is inaccurate beyond
};

/// The lowest point observed in a cell, from short range.
struct GroundCell {
  Vec3f p_level = Vec3f::Zero();  ///< [m]
  float range_m = 0.0F;           ///< of the observation
  float first_way_m = -1.0F;      ///< distance driven at the first observation; negative: none
  float last_way_m = -1.0F;       ///< and at the last
  std::int32_t i = 0, j = 0;
};

/// A window of cells that moves with the vehicle: a cell's number determines its slot, so that an
/// entering cell replaces one behind, and memory is fixed. Frame `level` is upright and smooth; its
/// position and heading are arbitrary.
class GroundPatch {
 public:
  explicit GroundPatch(const GroundPatchParams& params);

  void clear();

  /// @param lowest_vehicle  the lowest points of columns of a scan
  /// @param way_m  distance driven so far
  void add(const Points& lowest_vehicle, const Pose& T_level_vehicle, double way_m);

  /// Cells first observed at or after one distance driven, and last at or after another; always in
  /// the same order, which is not spatial: the first n are a fair sample of all. Allocates nothing
  /// if `out` has room for capacity().
  void gather(double first_way_m, double last_way_m, std::vector<GroundCell>* out) const;

  [[nodiscard]] std::size_t capacity() const { return slots_.size(); }

 private:
  GroundPatchParams params_;
  std::vector<GroundCell> slots_;
};

}  // namespace rcs::sp

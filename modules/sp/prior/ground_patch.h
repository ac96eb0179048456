#pragma once
// The ground that was seen on the last stretch of the way: one height a cell.

#include <cstdint>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::sp {

struct GroundPatchParams {
  double cell_m = 2.0;    ///< one height each
  double reach_m = 40.0;  ///< of the vehicle; farther a tilted scan says little
};

/// The lowest point that was seen in a cell, from near.
struct GroundCell {
  Vec3f p_level = Vec3f::Zero();  ///< [m]
  float range_m = 0.0F;           ///< from which it was seen
  float first_way_m = -1.0F;      ///< of the vehicle when it was first seen; negative: never
  float last_way_m = -1.0F;       ///< and last
  std::int32_t i = 0, j = 0;
};

/// A window of cells that goes with the vehicle: a cell's slot follows from its number, so that
/// what enters takes the place of what is behind, and memory is fixed. Frame `level` is upright and
/// smooth; where it lies, and its heading, is any.
class GroundPatch {
 public:
  explicit GroundPatch(const GroundPatchParams& params);

  void clear();

  /// @param lowest_vehicle  the lowest points of columns of a scan
  /// @param way_m  driven so far
  void add(const Points& lowest_vehicle, const Pose& T_level_vehicle, double way_m);

  /// Cells that were first seen at or after one place on the way, and last at or after another;
  /// always in the same order, which is none in space: the first n are a fair sample of all.
  /// Allocates nothing when `out` has room for capacity().
  void gather(double first_way_m, double last_way_m, std::vector<GroundCell>* out) const;

  [[nodiscard]] std::size_t capacity() const { return slots_.size(); }

 private:
  GroundPatchParams params_;
  std::vector<GroundCell> slots_;
};

}  // namespace rcs::sp

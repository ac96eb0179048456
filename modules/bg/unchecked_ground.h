#pragma once
// Ground in the blind zone of the LADAR that should have been seen from near, but came there while
// the scans were lost. From afar a ditch looks like level ground, and in the blind zone it does
// not come into sight: after a loss of the LADAR at speed the vehicle may stand before one. Such
// ground is an obstacle until the vehicle has backed and looked at it.

#include <cstdint>

#include "modules/bg/hidden_ground.h"
#include "modules/bg/path.h"
#include "modules/vj/traversal_cost.h"
#include "rcs/base/grid.h"

namespace rcs::bg {

/// What the terrain knows of the ground around the vehicle now.
enum class Scans {
  kNew,   ///< a scan from about here that it did not have before
  kNone,  ///< the same as before
  kLost,  ///< its newest scan is too old to have been made here
};

/// Allocates nothing after the first terrain.
class UncheckedGround {
 public:
  UncheckedGround(const SightParams& params, const Shape& shape) : params_(params), shape_(shape) {}

  /// Marks unchecked ground in the blind zone as obstacles. What the vehicle has driven over is
  /// checked.
  void mark(const Place& vehicle, Scans scans, vj::Terrain* terrain);

  /// Frame local has been replaced: the vehicle, which has hardly moved, is at `here` in the new
  /// one.
  void move_to_frame_of(const Place& here);

 private:
  void begin(double cell_m);
  void drive_over(const Place& vehicle);

  SightParams params_;
  Shape shape_;
  // Scans that have shown the cell from near, and kMissed: it could have been seen, without scans.
  Grid<std::uint8_t> looks_{1, 0.4};
  Grid<std::uint8_t> moved_{1, 0.4};
  Place here_;
};

}  // namespace rcs::bg

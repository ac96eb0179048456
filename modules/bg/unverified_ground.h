#pragma once
// Ground in the blind zone of the LADAR that was not observed at short range, because it came there
// while the scans were lost. At long range a ditch looks like level ground, and the blind zone is
// not observed: after a loss of the LADAR at speed the vehicle may stand in front of a ditch. Such
// ground is an obstacle until the vehicle has reversed and observed it.

#include <cstdint>

#include "modules/bg/hidden_ground.h"
#include "modules/bg/path.h"
#include "modules/bg/scan_watch.h"
#include "modules/vj/traversal_cost.h"
#include "rcs/base/grid.h"

namespace rcs::bg {

/// Allocates nothing after the first terrain.
class UnverifiedGround {
 public:
  UnverifiedGround(const SightParams& params, const Shape& shape)
      : params_(params), shape_(shape) {}

  /// Marks unverified ground in the blind zone as obstacles. Ground that the vehicle has driven
  /// over is verified.
  void mark(const Pose2d& vehicle, Scans scans, vj::Terrain* terrain);

  /// Frame local has been replaced: the vehicle, which has hardly moved, is at `here` in the new
  /// one.
  void move_to_frame_of(const Pose2d& here);

 private:
  void begin(double cell_m);
  void drive_over(const Pose2d& vehicle);

  SightParams params_;
  Shape shape_;
  // Observations of the cell at short range, and kMissed: it was in sight while scans were lost.
  Grid<std::uint8_t> observations_{1, 0.4};
  Grid<std::uint8_t> moved_{1, 0.4};
  Pose2d here_;
};

}  // namespace rcs::bg

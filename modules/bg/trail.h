#pragma once
// The ground that the vehicle has just driven over: drivable, whether it was seen or not.

#include <array>
#include <cstddef>

#include "modules/bg/path.h"
#include "modules/vj/traversal_cost.h"

namespace rcs::bg {

/// The last 20 m or so of the path driven.
class Trail {
 public:
  void add(const Pose2d& here);
  /// Frame local has been replaced, and the vehicle is at `here` in the new frame: it has hardly
  /// moved meanwhile, or continued on its path.
  void move_to_frame_of(const Pose2d& here);

  /// Sets unknown cells under the outline of the vehicle along the trail to known, level ground.
  void mark(const Shape& shape, vj::Terrain* terrain) const;

  /// The way back, as far as the vehicle came ahead: points without clearance and speeds.
  /// @param path  empty if it did not come ahead
  void lead_back(double max_m, Path* path) const;

 private:
  static constexpr double kStep_m = 0.4;
  std::array<Pose2d, 50> places_{};  // a ring
  std::size_t count_ = 0;            // added so far
  Pose2d here_;                      // newest pose
};

}  // namespace rcs::bg

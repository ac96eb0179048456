#pragma once
// The ground that the vehicle has just driven over: known to be drivable, whether it was seen or
// not.

#include <array>
#include <cstddef>

#include "modules/bg/path.h"
#include "modules/vj/traversal_cost.h"

namespace rcs::bg {

/// The last 20 m or so of the vehicle's way.
class Trail {
 public:
  void add(const Place& here);
  /// The frame has been replaced, and the vehicle is at `here` in the new one: it has hardly moved
  /// meanwhile, or on along its way.
  void move_to_frame_of(const Place& here);

  /// Makes known, as level ground, what is unknown under the vehicle's outline along the trail.
  void mark(const Shape& shape, vj::Terrain* terrain) const;

 private:
  static constexpr double kStep_m = 0.4;
  std::array<Place, 50> places_{};  // a ring
  std::size_t count_ = 0;           // added so far
  Place here_;                      // newest of all
};

}  // namespace rcs::bg

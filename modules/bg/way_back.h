#pragma once
// The way back: places that the vehicle has driven over before, in the order in which it drives to
// them now. It keeps to the line through them as long as that is free.

#include <vector>

#include "modules/bg/path.h"
#include "modules/vj/traversal_cost.h"
#include "rcs/base/linear.h"
#include "rcs/base/stamp.h"

namespace rcs::bg {

/// Sets Ground::off_route_m. Ground below the vehicle on its way was driven over: it is no obstacle
/// for its slope, or for a step that the weights allow. What stands there now is higher, and an
/// obstacle without a step is hidden ground. Ground between places that are more than 3.5 m apart
/// was not driven over.
/// @param line  in the frame of the terrain
void mark_way_back(const std::vector<Vec2>& line, const Shape& shape, const vj::Weights& weights,
                   vj::Terrain* terrain);

/// The rest of the way: along a smooth curve through the places (Catmull & Rom 1974), from the
/// point of it that is nearest to the vehicle, up to a corner or a reversal. Points without
/// clearance and speeds; allocates nothing for up to path->capacity() points.
/// @param line  places 1 to 3 m apart; the way is interrupted between places that are more than
///   3.5 m apart
/// @param path  at most `max_m` long; empty if the vehicle is not on the way, or not in its
///   direction
void follow_way_back(const std::vector<Vec2>& line, const Pose2d& vehicle, const Shape& shape,
                     double max_m, Path* path);

/// Whether the vehicle keeps to its way. An obstacle on ground that it has driven over before is
/// mostly a wrong one, seen from afar: it keeps to the way, approaches the obstacle, and leaves the
/// way only if it remains.
class WayBackWatch {
 public:
  enum class Along {
    kNo,     ///< the vehicle is not on the way, or leaves it: a path is searched
    kWaits,  ///< up to an obstacle
    kFree
  };
  /// The way ahead of a vehicle that is on it.
  struct Ahead {
    double free_m = 0.0;
    bool to_the_end = false;
    double min_m = 0.0;        ///< without stopping
    double rejoining_m = 0.0;  ///< to return to the way after it was left
  };

  void begin() { *this = WayBackWatch(); }
  /// Not on the way, or there is none.
  void off() { keeps_ = false; }
  Along on(const Ahead& ahead, const Pose2d& vehicle, Stamp now);
  /// For an obstacle that holds the vehicle: until it has moved and the way is free again.
  void leave(const Pose2d& vehicle);

  /// The path of now is a part of the way.
  [[nodiscard]] bool keeps() const { return keeps_; }

 private:
  bool keeps_ = false;
  bool leaves_ = false;
  Pose2d left_at_;
  Stamp blocked_since_ = Stamp::max();
};

}  // namespace rcs::bg

#pragma once
// The clearance from forbidden ground that the vehicle must keep, and the way out of forbidden
// ground.

#include <algorithm>
#include <cstddef>
#include <optional>

#include "modules/bg/path.h"

namespace rcs::bg {

/// Normally the vehicle keeps the protection level of its position and a constant. A vehicle that
/// is nearer, because its level has grown or because it was brought there, must be able to leave:
/// then it keeps the clearance that it has, less what its outline needs to move. That limit rises
/// while the vehicle leaves and never falls, so that no sequence of motions leads further in.
class ZoneGuard {
 public:
  /// Once a cycle.
  /// @param clearance_m  of the outline, see zone_clearance()
  /// @param level_m  horizontal protection level in frame world, finite
  void update(double clearance_m, double level_m) {
    clearance_m_ = clearance_m;
    level_m_ = level_m;
    if (clearance_m < level_m || held_m_) {
      held_m_ = std::max(held_m_.value_or(clearance_m - kOutline_m), clearance_m - kOutline_m);
    }
    if (held_m_ && *held_m_ >= level_m + kMargin_m) held_m_.reset();
  }
  /// Frame world has stepped: the clearance has changed without a motion.
  void reset() { held_m_.reset(); }

  /// The vehicle may be in forbidden ground.
  [[nodiscard]] bool too_near() const { return clearance_m_ < level_m_; }
  [[nodiscard]] double clearance_m() const { return clearance_m_; }
  /// Ground with less clearance is an obstacle; negative inside of forbidden ground.
  [[nodiscard]] double required_m() const {
    return held_m_ ? std::min(*held_m_, usual_m()) : usual_m();
  }
  /// The same of a vehicle that has left.
  [[nodiscard]] double usual_m() const { return level_m_ + kMargin_m; }
  /// Clearance with which the vehicle has left.
  [[nodiscard]] double free_m() const { return level_m_; }

 private:
  static constexpr double kMargin_m = 0.5;  // changes of the level, and rounding to cells
  // The margin of a path (Shape::min_margin_m, 0.25 m), and half of the diagonal of a cell.
  static constexpr double kOutline_m = 0.7;

  double clearance_m_ = 0.0;
  double level_m_ = 0.0;
  std::optional<double> held_m_;
};

/// Whether a path leads out of forbidden ground: it keeps the limit of the guard, and within 20 m
/// it has left, or has at least a metre more clearance than the vehicle.
/// @param at  index of the point at which the vehicle is
/// @param clearance_at  of the outline at a place of the path
template <class ClearanceAt>
[[nodiscard]] bool leads_out(const Path& path, std::size_t at, const ZoneGuard& guard,
                             ClearanceAt&& clearance_at) {
  constexpr double kCells_m = 0.1;  // what the cells of the map round
  constexpr double kWay_m = 20.0;   // with the turns that the vehicle needs
  constexpr double kProgress_m = 1.0;
  for (std::size_t k = at + 1; k < path.size(); ++k) {
    if (path[k].s_m - path[at].s_m > kWay_m) return false;
    const double clearance_m = clearance_at(path[k].place);
    if (clearance_m < guard.required_m() - kCells_m) return false;
    if (clearance_m >= std::min(guard.free_m(), guard.clearance_m() + kProgress_m)) return true;
  }
  return false;
}

}  // namespace rcs::bg

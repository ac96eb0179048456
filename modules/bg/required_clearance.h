#pragma once
// How near to obstacles a motion may come that begins near to one.

#include <algorithm>
#include <optional>

namespace rcs::bg {

/// A vehicle that is nearer to an obstacle than the margin must be able to leave, but must not come
/// nearer from cycle to cycle and with every new path. A part of the margin, the slack, is for
/// deviations from the path. Below it the vehicle stops; from there it may leave, and the clearance
/// of that stop, less the rounding of the map, is the limit until it has left. An obstacle that
/// appears next to the vehicle lowers the limit by as much as it has come nearer.
class RequiredClearance {
 public:
  explicit RequiredClearance(double margin_m) : margin_m_(margin_m) {}

  /// The vehicle has moved on the same map.
  void moved(double clearance_m, bool at_rest) {
    appeared_m_ = std::clamp(margin_m_ - clearance_m, 0.0, appeared_m_);
    if (is_above_floor(clearance_m)) {
      stopped_at_m_.reset();
    } else if (stopped_at_m_) {
      stopped_at_m_ = std::max(*stopped_at_m_, clearance_m);
    } else if (at_rest) {
      stopped_at_m_ = clearance_m;
    }
  }
  /// The map has changed: clearance of the vehicle where it is, before and after.
  void map_changed(double before_m, double after_m) {
    const double nearer_m =
        std::max(0.0, std::min(before_m, margin_m_) - std::min(after_m, margin_m_));
    appeared_m_ += nearer_m;
    if (stopped_at_m_) *stopped_at_m_ -= nearer_m;
    moved(after_m, false);
  }
  /// Without a map before.
  void begin(double clearance_m) {
    stopped_at_m_.reset();
    map_changed(margin_m_, clearance_m);
  }

  /// Of a motion that begins at this clearance. A larger one: the vehicle must stop first.
  [[nodiscard]] double of(double clearance_m) const {
    if (is_above_floor(clearance_m)) {
      const double min_m = std::min(floor_m(), clearance_m - kSame_m);
      return std::min(margin_m_, std::max(clearance_m - kSlack_m, min_m));
    }
    return stopped_at_m_ ? *stopped_at_m_ - kRounding_m : floor_m();
  }

 private:
  static constexpr double kSlack_m = 0.15;
  static constexpr double kSame_m = 0.03;  // smaller changes are no motion
  // Change of the clearance of an obstacle while the vehicle turns next to it: the cells of the map
  // and the discs of Body.
  static constexpr double kRounding_m = 0.12;

  [[nodiscard]] double floor_m() const { return margin_m_ - kSlack_m - appeared_m_; }
  [[nodiscard]] bool is_above_floor(double clearance_m) const {
    return clearance_m >= floor_m() - kSame_m;
  }

  double margin_m_;
  double appeared_m_ = 0.0;  // how much nearer than the margin obstacles have appeared
  /// Below the floor: largest clearance since the vehicle has stopped there.
  std::optional<double> stopped_at_m_;
};

}  // namespace rcs::bg

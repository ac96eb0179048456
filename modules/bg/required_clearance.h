#pragma once
// How near to obstacles a motion may come that begins near to one.

#include <algorithm>

namespace rcs::bg {

/// A vehicle that is nearer to an obstacle than the margin must be able to leave, but must not come
/// nearer with every new path. What counts is who came nearer: after an obstacle has appeared
/// beside the vehicle it may move as it could move before; what it has lost by its own motion it
/// does not get again.
class RequiredClearance {
 public:
  explicit RequiredClearance(double margin_m) : margin_m_(margin_m) {}

  /// The vehicle has moved on the same map.
  void moved(double clearance_m) {
    appeared_m_ = std::clamp(margin_m_ - clearance_m, 0.0, appeared_m_);
  }
  /// The map has changed: clearance of the vehicle where it is, before and after.
  void map_changed(double before_m, double after_m) {
    appeared_m_ += std::max(0.0, std::min(before_m, margin_m_) - std::min(after_m, margin_m_));
    moved(after_m);
  }
  /// Without a map before.
  void begin(double clearance_m) { map_changed(margin_m_, clearance_m); }

  /// Of a motion that begins at this clearance.
  [[nodiscard]] double of(double clearance_m) const {
    // The rounding of cells changes the clearance of an obstacle abeam: some slack is needed, and
    // from beyond the last of it hardly any.
    constexpr double kSlack_m = 0.15;
    constexpr double kHardly_m = 0.06;
    const double floor_m = margin_m_ - kSlack_m - appeared_m_;
    const double nearer_m = std::min(clearance_m - kHardly_m, floor_m);
    return std::min(margin_m_, std::max(clearance_m - kSlack_m, nearer_m));
  }

 private:
  double margin_m_;
  double appeared_m_ = 0.0;  // how much nearer than the margin obstacles have appeared
};

}  // namespace rcs::bg

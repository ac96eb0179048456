#pragma once
// Tests whether the heading of the filter is wrong while its fixes are not fused: a wrong heading
// turns the path of the filter against the fixes, whose drift would shift it.

#include <optional>

#include "rcs/base/linear.h"
#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"

namespace rcs::wm {

class TurnedPath {
 public:
  struct Turn {
    Pose T_new_old;  ///< about the vertical, and a horizontal shift
    double sigma_yaw_rad = 0.0;
    double sigma_m = 0.0;  ///< of one axis
  };

  /// @param own_m    position of the antenna by the filter, which does not use the fixes
  /// @param own_mps  velocity by the filter
  /// @param own_radps  its yaw rate
  /// @param fix_m    by the fix, same frame
  /// @param sigma_m  horizontal, of one axis of the fix
  void add(Stamp stamp, const Vec3& own_m, const Vec3& own_mps, double own_radps, const Vec3& fix_m,
           double sigma_m);

  /// The turn that explains the fixes, if it explains them much better than fixes that are shifted,
  /// drift at constant velocity, and have stamps that are off. That needs bends: on a straight a
  /// drift is the same, on a circle a stamp.
  [[nodiscard]] std::optional<Turn> found() const;

 private:
  static constexpr double kSpacing_m = 2.0;
  static constexpr double kShortest_m = 60.0;  ///< way of the filter
  static constexpr double kLongest_m = 300.0;  ///< then it begins again: a fault may have ended
  static constexpr double kDrift = 0.01;       ///< of the filter, over the way
  static constexpr double kClearly = 3.0;      ///< ratio of the RMS residuals
  static constexpr Duration kSilence = from_seconds(3.0);

  int n_ = 0;
  Stamp first_{}, last_{};
  Vec2 own0_ = Vec2::Zero(), fix0_ = Vec2::Zero();  // of the first pair: origin of the sums
  Vec2 last_own_ = Vec2::Zero();
  double way_m_ = 0.0, sigma_m_ = 0.0;
  Vec2 own_ = Vec2::Zero(), fix_ = Vec2::Zero();  // sums
  double own2_ = 0.0, fix2_ = 0.0, dot_ = 0.0, cross_ = 0.0;
  // Normal equations of fix - own = shift + drift t + own velocity * delay + own acceleration * k.
  Mat6 H_ = Mat6::Zero();
  Vec6 g_ = Vec6::Zero();
  double off2_ = 0.0;
};

}  // namespace rcs::wm

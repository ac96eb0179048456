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

  /// The antenna by the filter, which does not use the fixes.
  struct Own {
    Vec3 p_m, v_mps;
    double yaw_rate_radps = 0.0;
  };
  /// The antenna by the fix, same frame. Sigmas are horizontal, of one axis.
  struct Fix {
    Vec3 p_m;
    double sigma_m = 0.0;
    std::optional<Vec3> v_mps{};
    double sigma_mps = 0.0;
  };

  void add(Stamp stamp, const Own& own, const Fix& fix);

  /// The turn that explains the fixes, if it explains their positions or velocities much better
  /// than fixes that are shifted, drift at constant velocity, and have stamps that are off. That
  /// needs bends: on a straight a drift is the same, on a circle a stamp.
  [[nodiscard]] std::optional<Turn> found() const;

 private:
  [[nodiscard]] std::optional<double> by_positions() const;
  [[nodiscard]] std::optional<double> by_velocities() const;
  /// RMS residual of the positions turned by an angle, with the best shift.
  [[nodiscard]] double residual_m(double yaw_rad) const;
  [[nodiscard]] double allowed_m() const;

  static constexpr double kSpacing_m = 2.0;
  static constexpr double kShortest_m = 60.0;  ///< way of the filter
  static constexpr double kLongest_m = 300.0;  ///< then it begins again: a fault may have ended
  static constexpr double kDrift = 0.01;       ///< of the filter, over the way
  static constexpr double kClearly = 3.0;      ///< ratio of the RMS residuals
  static constexpr double kLikelier = 25.0;    ///< logarithm of the likelihood ratio
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
  // Of the velocities, over their variance: of fix - own = turn across own, and of
  // fix - own = drift + own acceleration * delay.
  int velocities_ = 0;
  double speed2_ = 0.0, across_ = 0.0, off_v2_ = 0.0;
  Mat3 H_v_ = Mat3::Zero();
  Vec3 g_v_ = Vec3::Zero();
};

}  // namespace rcs::wm

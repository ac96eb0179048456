#pragma once
// Where the filter starts from: level by the accelerometers, heading and place by GPS motion.

#include <array>
#include <optional>

#include "modules/wm/filter.h"

namespace rcs::wm {

/// A belief before anything is known: level, at the origin of a frame of its own.
[[nodiscard]] Belief initial_belief(const WmParams& params, Stamp stamp);

/// Levels by the INS' mean while the vehicle stands, or, `patience` over, while it moves.
class Leveler {
 public:
  /// @return the belief at imu.stamp once it is good; the heading is 0 in a frame of its own
  [[nodiscard]] std::optional<Belief> add(const ImuSample& imu, const WmParams& params);

  /// What of the specific force is gravity [m/s^2]: used until a datum says what it is.
  [[nodiscard]] double gravity() const { return gravity_; }
  [[nodiscard]] const Stillness& stillness() const { return stillness_; }

 private:
  Stillness stillness_;
  Stamp first_ = Stamp::max();
  Vec3 sum_angle_ = Vec3::Zero();  ///< since it stands, or since the start
  Vec3 sum_force_ = Vec3::Zero();
  double sum_s_ = 0.0;
  double gravity_ = Earth{}.gravity;
  bool still_ = false;
};

/// How the filter's own frame lies in the datum's.
struct Anchor {
  Pose T_new_old;  ///< a turn about the vertical and a shift
  double sigma_yaw_rad = 0.0;
  double sigma_m = 0.0;
  /// Velocity by GPS, where the belief has none of its own.
  std::optional<Vec3> v_world;
};

/// Finds the heading: the filter's own path (integrated from INS, LADAR or wheels) is laid over the
/// fixes by a turn about the vertical and a shift. An EKF started with an unknown heading would
/// linearize a circle; a fit over a baseline has no such trouble.
class HeadingFinder {
 public:
  /// @param state  the filter's state at the fix, in its own frame
  [[nodiscard]] std::optional<Anchor> add(Stamp stamp, const GpsFix& fix, const FilterState& state,
                                          const WmParams& params);
  void clear() { count_ = 0; }

 private:
  struct Pair {
    Stamp stamp{};
    Vec3 p_old, p_new;  ///< of the antenna, in the filter's frame and in the datum's
    double sigma_m = 0.0;
  };
  [[nodiscard]] std::optional<Anchor> by_path(const AlignParams& params) const;
  [[nodiscard]] std::optional<Anchor> by_course(const GpsFix& fix, const FilterState& state,
                                                const WmParams& params) const;

  std::array<Pair, 64> pairs_{};
  std::size_t count_ = 0;
};

/// By one match to the a priori map, which SP found by a search before anything absolute was known.
/// @param x  at the match's instant, in the filter's own frame
/// @return none where the match tells place or heading too poorly to start from
[[nodiscard]] std::optional<Anchor> anchor_by_map(const PriorMatch& match, const NavState& x,
                                                  const AlignParams& params);

/// Applies an anchor to a state in the filter's own frame.
void anchor(const Anchor& a, FilterState* state);

/// The same by a match to the a priori map: the belief errs as the survey does there.
void anchor_on_map(const Anchor& a, const MapBias& bias, FilterState* state);

}  // namespace rcs::wm

#pragma once
// Initialization of the filter: level by the accelerometers, heading and position by GPS motion.

#include <array>
#include <optional>

#include "modules/wm/filter.h"

namespace rcs::wm {

/// A belief before any measurement: level, at the origin of a frame of its own.
[[nodiscard]] Belief initial_belief(const WmParams& params, Stamp stamp);

/// A solution that is lost begins again from the sources: level by the mean specific force if the
/// INS is integrated, of unknown velocity, not georeferenced. The local pose continues, and an
/// excluded INS stays excluded; GPS and LADAR, from which it begins, are used again.
void begin_again(const WmParams& params, FilterState* state);

/// Levels by the mean of the INS while the vehicle stands or, after `patience`, while it moves.
class Leveler {
 public:
  /// @return the belief at imu.stamp once it is accurate enough; the heading is 0 in a frame of its
  ///   own
  [[nodiscard]] std::optional<Belief> add(const ImuSample& imu, const WmParams& params);

  /// Estimated gravity [m/s^2], used until a datum defines it.
  [[nodiscard]] double gravity() const { return gravity_; }
  [[nodiscard]] const Stillness& stillness() const { return stillness_; }

 private:
  Stillness stillness_;
  Stamp first_ = Stamp::max();
  Vec3 sum_angle_ = Vec3::Zero();  ///< since standstill began, or since the start
  Vec3 sum_force_ = Vec3::Zero();
  double sum_s_ = 0.0;
  double gravity_ = Earth{}.gravity;
  bool still_ = false;
};

/// Transformation of the filter's own frame to the frame of the datum.
struct Georeference {
  Pose T_new_old;  ///< a rotation about the vertical and a shift
  double sigma_yaw_rad = 0.0;
  double sigma_m = 0.0;
  Stamp stamp{};  ///< at which the shift and the velocity hold
  /// Of a filter that did not know its velocity, in the new frame.
  struct Motion {
    Vec3 v = Vec3::Zero();  ///< velocity; with `a`, what must be added to it [m/s]
    double sigma_mps = 0.0;
    /// Position of the vehicle; none: the filter is a free integration, corrected by `v` and `a`.
    std::optional<Vec3> p;
    Vec3 a = Vec3::Zero();    ///< horizontal acceleration that a tilt has hidden [m/s^2]
    double sigma_mps2 = 0.0;  ///< of `a`, if it is estimated
  };
  std::optional<Motion> motion;
};

/// Finds the heading: fits the path of the filter (integrated from INS, LADAR or wheels) to the
/// fixes by a rotation about the vertical and a shift. An EKF started with an unknown heading would
/// linearize over a full circle; a fit over a baseline does not. A path that the INS alone has
/// integrated from an unknown velocity is fitted with that velocity and an unknown tilt; or, if the
/// vehicle moves along its own axis, its heading is the course of the fixes.
class HeadingFinder {
 public:
  /// @param state  the filter's state at the fix, in its own frame
  [[nodiscard]] std::optional<Georeference> add(Stamp stamp, const GpsFix& fix,
                                                const FilterState& state, const WmParams& params);
  void clear() { count_ = 0; }

 private:
  struct Pair {
    Stamp stamp{};
    Vec3 p_old, p_new;  ///< of the antenna, in the frame of the filter and in that of the datum
    double yaw_old = 0.0;
    double sigma_m = 0.0;
  };
  [[nodiscard]] std::optional<Georeference> by_path(const AlignParams& params) const;
  [[nodiscard]] std::optional<Georeference> by_course(Stamp stamp, const GpsFix& fix,
                                                      const FilterState& state,
                                                      const WmParams& params) const;
  [[nodiscard]] std::optional<Georeference> by_positions(const FilterState& state,
                                                         const WmParams& params) const;
  [[nodiscard]] std::optional<Georeference> by_motion(const FilterState& state,
                                                      const WmParams& params) const;

  std::array<Pair, 64> pairs_{};
  std::size_t count_ = 0;
};

/// Georeference from one match to the a priori map, found by the initial localization of SP.
/// @param x  at the instant of the match, in the frame of the filter
/// @return none if the match determines position or heading too poorly for a start
[[nodiscard]] std::optional<Georeference> georeference_by_map(const PriorMatch& match,
                                                              const NavState& x,
                                                              const AlignParams& params);

/// Applies a georeference to a state in the frame of the filter.
void georeference(const Georeference& a, FilterState* state);

/// The same from a match to the a priori map: the belief inherits the bias of the survey there.
void georeference_on_map(const Georeference& a, const MapBias& bias, FilterState* state);

}  // namespace rcs::wm

#pragma once
// Between GPS and the gyro, whose courses differ: the shape of the difference. A wrong gyro turns
// the heading steadily and leaves the speed as it is. Fixes that drift have a velocity error that
// begins at once, is constant in the world, and shows in the speed as the vehicle turns. Fixes that
// are turned have a course that steps.

#include <array>
#include <cstddef>
#include <optional>

#include "rcs/base/linear.h"
#include "rcs/base/stamp.h"

namespace rcs::wm {

class CourseShape {
 public:
  /// Call it at least ten times a second.
  /// @param heading_radps  rate of the heading by the INS
  void turn(Stamp stamp, double heading_radps);
  /// @param v_fix_mps  horizontal velocity of the vehicle by the fix, world
  /// @param wheels_mps  speed by the wheels; 0: not known, and the comparison begins again
  void add(Stamp stamp, const Vec2& v_fix_mps, double wheels_mps);

  /// Logarithm of the likelihood ratio of a wrong gyro and of wrong fixes, over the last 20 s,
  /// if they have been received at least twice a second and without a gap.
  [[nodiscard]] std::optional<double> gyro_against_fixes() const;

 private:
  struct Sample {
    Stamp stamp{};
    double course_rad = 0.0;  ///< by the fix
    double speed_mps = 0.0;
    double turned_rad = 0.0;  ///< course less heading by the INS, from the first sample on
    double beyond_mps = 0.0;  ///< speed by the fix less that of the wheels
  };
  [[nodiscard]] std::size_t in_window() const;
  /// Sum of the squared residuals of a difference of the courses in proportion to angle(stamp),
  /// with an unknown factor and origin.
  template <class F>
  [[nodiscard]] double residual_of_angle(const F& angle) const;
  /// The same of one that grows from `begin` to `end`.
  [[nodiscard]] double residual_of_turn(Stamp begin, Stamp end) const;
  /// The same of a constant velocity error from `begin` on.
  [[nodiscard]] double residual_of_drift(Stamp begin) const;
  /// The same of a constant angle from `begin` on.
  [[nodiscard]] double residual_of_turned_fixes(Stamp begin) const;
  [[nodiscard]] const Sample& sample(std::size_t k) const { return samples_[k % kSamples]; }

  static constexpr std::size_t kSamples = 100;
  std::array<Sample, kSamples> samples_{};
  std::size_t count_ = 0;
  Stamp turned_ = Stamp::min();  ///< newest rate
  double heading_rad_ = 0.0;     ///< by the INS, from an unknown origin
};

}  // namespace rcs::wm

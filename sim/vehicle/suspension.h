#pragma once
// The body of the vehicle on its suspension: height, pitch and roll follow the ground under four
// wheels.

#include "rcs/base/pose.h"
#include "sim/terrain/world.h"
#include "sim/vehicle/course.h"

namespace rcs::sim {

struct VehicleParams {
  double wheelbase_m = 2.4;
  double track_m = 1.7;
  double imu_height_m =
      0.9;                 ///< height of the origin of the vehicle frame above level ground at rest
  double contact_m = 0.5;  ///< length of ground that a wheel averages over
  double heave_hz = 1.5;   ///< natural frequency of the body on its suspension
  double tilt_hz = 1.8;    ///< the same in pitch and roll
  double damping = 0.4;    ///< ratio of critical
};

/// One degree of freedom on a spring and a damper with a moving base (base excitation).
class Spring {
 public:
  Spring(double frequency_hz, double damping, double foot)
      : omega_(2.0 * kPi * frequency_hz), damping_(damping), foot_(foot), value_(foot) {}

  void step(double foot, double dt_s);
  [[nodiscard]] double value() const { return value_; }

 private:
  double omega_;
  double damping_;
  double foot_;
  double value_;
  double rate_ = 0.0;
};

class Suspension {
 public:
  static constexpr double kStep_s = 0.002;

  /// @param world  must outlive it
  /// @param at  where the body is at rest
  Suspension(const World* world, const VehicleParams& params, const CoursePoint& at);

  /// Advances the wheels to a pose, within kStep_s.
  void step(const CoursePoint& at);
  /// T_world_vehicle of the body at a pose, in the present state of the suspension.
  [[nodiscard]] Pose pose(const CoursePoint& at) const;

 private:
  /// The plane under the wheels.
  struct Footing {
    double height_m;
    double slope_ahead;  ///< rise per metre forward
    double slope_left;
  };
  [[nodiscard]] Footing footing(const CoursePoint& at) const;

  const World* world_;
  VehicleParams params_;
  Spring heave_;
  Spring pitch_;
  Spring roll_;
};

}  // namespace rcs::sim

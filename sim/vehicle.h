#pragma once
// The vehicle's body on its springs: from course and ground to a smooth motion.

#include "sim/course.h"
#include "sim/trajectory.h"
#include "sim/world.h"

namespace rcs::sim {

struct VehicleParams {
  double wheelbase_m = 2.4;  ///< [0.5, 10]
  double track_m = 1.7;      ///< [0.5, 5]
  double imu_height_m =
      0.9;                 ///< of the vehicle frame's origin above level ground at rest, [0.1, 3]
  double contact_m = 0.5;  ///< length of ground that a wheel averages over, [0.05, 2]
  double heave_hz = 1.5;   ///< natural frequency of the body on its springs, [0.5, 10]
  double tilt_hz = 1.8;    ///< the same in pitch and roll, [0.5, 10]
  double damping = 0.4;    ///< ratio of critical, (0, 2]
};

/// Drives the course: the body's height, pitch and roll answer the ground under the four wheels as
/// a damped spring does (base excitation), the heading follows the course.
/// @param duration_s  of the motion; at rest after the end of the course
[[nodiscard]] Trajectory drive(const Course& course, const World& world,
                               const VehicleParams& params, double duration_s);

}  // namespace rcs::sim

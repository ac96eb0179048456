#pragma once
// The scripted drive: from course and ground to a smooth motion.

#include "sim/terrain/world.h"
#include "sim/vehicle/course.h"
#include "sim/vehicle/suspension.h"
#include "sim/vehicle/trajectory.h"

namespace rcs::sim {

/// Between knots of the motion: ten steps of the suspension.
constexpr int kStepsPerKnot = 10;
constexpr double kKnotInterval_s = Suspension::kStep_s * kStepsPerKnot;

/// Drives the course: height, pitch and roll of the body follow the ground through the suspension,
/// the heading follows the course.
/// @param duration_s  of the motion; at rest after the end of the course
[[nodiscard]] Trajectory drive(const Course& course, const World& world,
                               const VehicleParams& params, double duration_s);

}  // namespace rcs::sim

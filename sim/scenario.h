#pragma once
// Everything that a simulated drive depends on.

#include <string>

#include "sim/course.h"
#include "sim/gps.h"
#include "sim/inertial.h"
#include "sim/ladar.h"
#include "sim/odometry.h"
#include "sim/prior_map.h"
#include "sim/vehicle.h"
#include "sim/world.h"

namespace rcs::sim {

enum class LadarKind { kNone, kImager, kSpinning };

struct Scenario {
  std::uint64_t seed = 1;  ///< of all noise and of the errors of mounting
  double duration_s = 0.0;
  Geodetic datum{radians(40.43), radians(-76.57), {150.0}};

  WorldParams world;
  Dem dem;
  CourseParams course;
  VehicleParams vehicle;

  LadarKind ladar = LadarKind::kImager;
  BeamParams beam;
  MountParams mount;
  ImagerParams imager;
  SpinningParams spinning;
  double ladar_clock_offset_s = 0.005;  ///< its stamps minus the truth, [-0.1, 0.1]

  InertialParams ins;
  GpsParams gps;
  OdometryParams odometry;
  PriorMapParams prior_map;
};

}  // namespace rcs::sim

#pragma once
// All parameters of a simulated drive.

#include <vector>

#include "sim/actors/actor.h"
#include "sim/sensors/gps.h"
#include "sim/sensors/inertial.h"
#include "sim/sensors/ladar.h"
#include "sim/sensors/odometry.h"
#include "sim/terrain/survey_model.h"
#include "sim/terrain/world.h"
#include "sim/vehicle/course.h"
#include "sim/vehicle/drive_model.h"
#include "sim/vehicle/suspension.h"

namespace rcs::sim {

enum class LadarKind { kNone, kImager, kSpinning };

struct Scenario {
  std::uint64_t seed = 1;  ///< of all noise and of the mounting errors
  double duration_s = 0.0;
  Geodetic datum{radians(40.43), radians(-76.57), {150.0}};

  WorldParams world;
  Dem dem;
  CourseParams course;
  VehicleParams vehicle;
  bool commanded = false;  ///< true: drive commands move the vehicle; false: it follows the course
  DriveParams drive;       ///< when commanded
  std::vector<ActorScript> actors;

  LadarKind ladar = LadarKind::kImager;
  BeamParams beam;
  MountParams mount;
  ImagerParams imager;
  SpinningParams spinning;
  double ladar_clock_offset_s = 0.005;  ///< its stamps minus true time
  std::vector<Outage> ladar_outages;    ///< no facet within one, not even an empty one

  InertialParams ins;
  GpsParams gps;
  OdometryParams odometry;
  PriorMapParams prior_map;
};

}  // namespace rcs::sim

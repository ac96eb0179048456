#pragma once
// Worlds and drives shared by several tests of the simulator.

#include <vector>

#include "sim/sensors/ladar.h"
#include "sim/terrain/world.h"
#include "sim/vehicle/course.h"
#include "sim/vehicle/scripted_drive.h"

namespace rcs::sim {

inline CourseParams s_course() {
  CourseParams p;
  p.waypoints_world = {{0, 0}, {40, 0}, {80, 20}, {120, 10}, {150, 40}};
  return p;
}

/// The plane z = 0 with nothing on it.
inline WorldParams flat_world() {
  WorldParams p;
  p.rocks.per_m2 = 0.0;
  p.vegetation.bushes_per_m2 = 0.0;
  p.vegetation.trees_per_m2 = 0.0;
  p.vegetation.grass_height_m = 0.0;
  return p;
}

inline WorldParams bare_hills() {
  WorldParams p = flat_world();
  p.octaves = {{51.2, 1.5}, {12.8, 0.4}, {3.2, 0.1}, {0.8, 0.03}, {0.2, 0.01}};
  return p;
}

/// A beam that adds nothing.
inline BeamParams ideal_beam() {
  BeamParams p;
  p.sigma_m = 0.0;
  p.half_angle_rad = 0.0;
  p.missing_share = 0.0;
  p.empty_facet_share = 0.0;
  return p;
}

inline MountParams exact_mount() {
  MountParams p;
  p.error_m = 0.0;
  p.error_rad = 0.0;
  return p;
}

}  // namespace rcs::sim

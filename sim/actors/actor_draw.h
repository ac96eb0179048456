#pragma once
// Moving actors that are drawn by seed, one or two on each leg of a course.

#include <cstdint>
#include <string>
#include <vector>

#include "sim/actors/actor.h"

namespace rcs::sim {

struct ActorParams {
  std::vector<std::string> kinds;  ///< crossing, following, oncoming, appearing; empty: none
  int max_per_leg = 2;
  double people_share = 0.7;  ///< the others are vehicles
  double person_min_mps = 0.5;
  double person_max_mps = 2.0;
  double vehicle_min_mps = 1.0;
  double vehicle_max_mps = 4.0;
};

/// @return an unknown kind: its name; empty: all are known
[[nodiscard]] std::string unknown_actor(const std::vector<std::string>& kinds);

/// Crossing: across the leg, started so that the actor is on the leg while the vehicle is before
/// that place. Following: ahead of the vehicle in its direction, until the actor turns off; the
/// last of its leg, so that the vehicle does not stop in front of an actor that it has overtaken.
/// Oncoming: against the vehicle, near the line of the leg. Appearing: where the vehicle comes
/// within 8 m of a place on the leg, 5 m beyond the distance in which it can stop.
/// @param approach_mps  speed at which the vehicle is expected to drive the legs
/// @param rest_s  nothing starts before it
[[nodiscard]] std::vector<ActorScript> draw_actors(const ActorParams& params,
                                                   const std::vector<Vec2>& waypoints_world,
                                                   double approach_mps, double rest_s,
                                                   std::uint64_t seed);

}  // namespace rcs::sim

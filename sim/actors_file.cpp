#include "sim/actors_file.h"

#include <string>

namespace rcs::sim {

void read_actors(ParamTable* root, std::vector<ActorScript>* actors) {
  if (root->has("actor")) actors->clear();
  for (ParamTable table : root->tables("actor")) {
    ActorScript a;
    std::string kind = "person";
    table.get("kind", &kind, {"person", "vehicle"},
              "Moving actor: a person is a cylinder of radius 0.3 m and height 1.8 m, a vehicle a "
              "box of 4.5 x 1.9 x 1.6 m. It stops for nothing.");
    a.kind = kind == "person" ? ActorKind::kPerson : ActorKind::kVehicle;
    table.get("speed_mps", &a.speed_mps, {0, 15}, "Speed of the actor on its path.");
    table.get(
        "start_s", &a.start_s, {0, 1e5},
        "Simulation time from which the actor moves; before, it stands at its first waypoint.");
    table.get("within_m", &a.within_m, {0, 500},
              "The actor also waits until the vehicle is within this distance of its first "
              "waypoint; 0: it does not.");
    for (ParamTable waypoint : table.tables("waypoint")) {
      Vec2 p = Vec2::Zero();
      waypoint.get("x_m", &p.x(), {-5000, 5000},
                   "East coordinate of a waypoint of the actor in frame world.");
      waypoint.get("y_m", &p.y(), {-5000, 5000},
                   "North coordinate of a waypoint of the actor in frame world.");
      a.waypoints_world.push_back(p);
    }
    if (a.waypoints_world.size() < 2) {
      table.fail("waypoint", "at least two are needed");
      a.waypoints_world.resize(2, Vec2::Zero());
    }
    actors->push_back(a);
  }
}

void read_actor_params(ParamTable table, ActorParams* actors) {
  table.get(
      "kinds", &actors->kinds,
      "Moving actors that are drawn by seed on each leg of the course: crossing, following "
      "(ahead of the vehicle, in its direction), oncoming, appearing (at once, 5 m beyond the "
      "distance in which the vehicle can stop). Empty: none.");
  if (const std::string unknown = unknown_actor(actors->kinds); !unknown.empty()) {
    table.fail("kinds",
               "\"" + unknown + "\" is not one of crossing, following, oncoming, appearing");
  }
  table.get("max_per_leg", &actors->max_per_leg, {1, 5},
            "Largest number of actors that are drawn for a leg; the smallest is one.");
  table.get("people_share", &actors->people_share, {0, 1},
            "Share of people among the actors that are drawn [1]; the others are vehicles.");
  table.get("person_min_mps", &actors->person_min_mps, {0.1, 10}, "Smallest speed of a person.");
  table.get("person_max_mps", &actors->person_max_mps, {actors->person_min_mps, 10},
            "Largest speed of a person, not less than person_min_mps.");
  table.get("vehicle_min_mps", &actors->vehicle_min_mps, {0.1, 15}, "Smallest speed of a vehicle.");
  table.get("vehicle_max_mps", &actors->vehicle_max_mps, {actors->vehicle_min_mps, 15},
            "Largest speed of a vehicle, not less than vehicle_min_mps.");
}

}  // namespace rcs::sim

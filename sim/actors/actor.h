#pragma once
// Moving actors on scripted paths: people and vehicles. An actor follows its path at constant speed
// and stops for nothing, neither for the vehicle nor for rocks, trees or other actors. Before its
// start and after its end it stands.

#include <vector>

#include "rcs/base/linear.h"
#include "sim/terrain/clearance.h"
#include "sim/terrain/world.h"
#include "sim/vehicle/course.h"

namespace rcs::sim {

enum class ActorKind {
  kPerson,  ///< vertical cylinder, radius 0.3 m, height 1.8 m
  kVehicle  ///< upright box, 4.5 m x 1.9 m, height 1.6 m
};

struct ActorScript {
  ActorKind kind = ActorKind::kPerson;
  std::vector<Vec2> waypoints_world;  ///< at least two; straight lines between them
  double speed_mps = 1.0;
  double start_s = 0.0;  ///< simulation time of the start
  /// The start also waits until the vehicle is within this distance of the first waypoint; 0: it
  /// does not.
  double within_m = 0.0;
  /// Above 0: it does not exist before its start. Then it stands across the path of the vehicle,
  /// this far beyond the distance in which the vehicle can stop (stop_m()), whatever its waypoints.
  double appears_beyond_m = 0.0;
};

/// Distance that a vehicle needs from something that it can see to rest [m]: 0.45 s until it acts
/// (a scan, a map, a cycle of BG, the actuators), and the full brake of 5 m/s^2.
[[nodiscard]] double stop_m(double speed_mps);

/// Where an actor is; its heading is that of the segment.
struct ActorPlace {
  ActorKind kind = ActorKind::kPerson;
  CoursePoint at;
};

/// @param moving_s  time since the start; negative: before it
[[nodiscard]] ActorPlace place_on(const ActorScript& script, double moving_s);

/// Where a ray hits the body of an actor.
/// @param ground_m  height of the ground under its centre, frame world
/// @param hit  replaced by a nearer hit
/// @return whether it was replaced
bool meet(const ActorPlace& actor, double ground_m, const Ray& ray, Hit* hit);

/// Distance in the plane between the bodies of an actor and of the vehicle [m]; not positive: they
/// touch. Both bodies reach from the ground to above the bumper, so heights are ignored.
[[nodiscard]] double distance(const ActorPlace& actor, const CoursePoint& vehicle,
                              const Footprint& footprint);
/// Distance in the plane of a place from the body of an actor; not positive: inside.
[[nodiscard]] double distance(const ActorPlace& actor, const Vec2& place_world);

/// The actors of a scenario, whose starts depend on where the vehicle was.
class Actors {
 public:
  explicit Actors(std::vector<ActorScript> scripts);

  /// Starts the actors that wait for the vehicle. Call with times that do not decrease.
  void observe(const CoursePoint& vehicle, double speed_mps, double time_s);

  [[nodiscard]] std::size_t size() const { return scripts_.size(); }
  [[nodiscard]] const ActorScript& script(std::size_t k) const { return scripts_[k]; }
  /// Simulation time of the start; infinite: not yet known.
  [[nodiscard]] double start_s(std::size_t k) const { return start_s_[k]; }
  [[nodiscard]] bool started(std::size_t k, double time_s) const { return time_s >= start_s_[k]; }
  /// False: it has not appeared yet.
  [[nodiscard]] bool exists(std::size_t k, double time_s) const {
    return scripts_[k].appears_beyond_m <= 0.0 || started(k, time_s);
  }
  /// Beyond every world if it does not exist.
  [[nodiscard]] ActorPlace at(std::size_t k, double time_s) const;
  /// Whether a ray hits an actor before the range in `hit`, which is replaced then.
  bool meet(const World& world, const Ray& ray, double time_s, Hit* hit) const;

 private:
  std::vector<ActorScript> scripts_;
  std::vector<double> start_s_;  // infinite: not yet known
};

}  // namespace rcs::sim

#pragma once
// Contact of the vehicle with moving actors: ground truth for the assessment of a drive.

#include <vector>

#include "sim/actors/actor.h"

namespace rcs::sim {

struct ActorContact {
  double time_s = 0.0;
  std::size_t actor = 0;
  double speed_mps = 0.0;  ///< of the vehicle
  /// Of the centre of the actor, seen from the centre of the vehicle; positive left.
  double bearing_rad = 0.0;
  /// The vehicle had been at rest for the last second: the actor ran into it. All other contacts
  /// count against the vehicle, whatever side of it the actor touches.
  bool ran_into_vehicle = false;
};

/// Collects the contacts of a drive, each when it begins.
class ActorContacts {
 public:
  /// A vehicle that is slower than this is at rest.
  static constexpr double kRest_mps = 0.05;
  static constexpr double kRest_s = 1.0;

  /// Call with times that do not decrease, at least ten times a second.
  void observe(const Actors& actors, const CoursePoint& vehicle, double speed_mps,
               const Footprint& footprint, double time_s);

  [[nodiscard]] const std::vector<ActorContact>& contacts() const { return contacts_; }
  /// Smallest distance between the vehicle and each actor since that started [m]; kFar_m: it did
  /// not start, or has never been within that distance.
  [[nodiscard]] const std::vector<double>& nearest_m() const { return nearest_m_; }
  static constexpr double kFar_m = 30.0;

 private:
  std::vector<ActorContact> contacts_;
  std::vector<double> nearest_m_;
  std::vector<bool> touching_;
  double moved_s_ = 0.0;  // last time at which the vehicle was not at rest
};

}  // namespace rcs::sim

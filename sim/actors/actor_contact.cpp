#include "sim/actors/actor_contact.h"

#include <algorithm>
#include <cmath>

namespace rcs::sim {

void ActorContacts::observe(const Actors& actors, const CoursePoint& vehicle, double speed_mps,
                            const Footprint& footprint, double time_s) {
  nearest_m_.resize(actors.size(), kFar_m);
  touching_.resize(actors.size(), false);
  if (speed_mps > kRest_mps) moved_s_ = time_s;
  for (std::size_t k = 0; k < actors.size(); ++k) {
    const ActorPlace actor = actors.at(k, time_s);
    const Vec2 to = actor.at.p_world - vehicle.p_world;
    if (to.norm() > kFar_m + 10.0) continue;
    const double distance_m = distance(actor, vehicle, footprint);
    if (actors.started(k, time_s)) nearest_m_[k] = std::min(nearest_m_[k], distance_m);
    const bool touches = distance_m <= 0.0;
    if (touches && !touching_[k]) {
      const double bearing_rad = wrap_angle(std::atan2(to.y(), to.x()) - vehicle.heading_rad);
      contacts_.push_back({time_s, k, speed_mps, bearing_rad, time_s - moved_s_ >= kRest_s});
    }
    touching_[k] = touches;
  }
}

}  // namespace rcs::sim

#include "rcs/node/waypoint_check.h"

#include "lcmtypes/convert.h"

namespace rcs {

std::string_view waypoint_objection(const command_t& m) {
  constexpr double kFarthest_m = 1e6;
  if (m.n < 1 || m.n > kMaxWaypoints) {
    return "command rejected: the number of waypoints is not 1 to 64";
  }
  if (m.waypoints_done < 0 || m.waypoints_done > m.n) {
    return "command rejected: waypoints_done is not 0 to the number of waypoints";
  }
  for (const waypoint_t& w : m.waypoint) {
    const Vec3 p = from_message(w.p_m);
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > kFarthest_m) {
      return "command rejected: a waypoint is not finite or is beyond 1000 km";
    }
    if (!(w.radius_m >= 0.5 && w.radius_m <= 50.0)) {
      return "command rejected: the radius of a waypoint is not 0.5 to 50 m";
    }
    if (!(w.speed_mps > 0.0 && w.speed_mps <= 30.0)) {
      return "command rejected: the speed of a waypoint is not above 0 and up to 30 m/s";
    }
  }
  return "";
}

}  // namespace rcs

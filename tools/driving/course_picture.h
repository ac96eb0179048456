#pragma once
// A drive through the simulated world as a picture from above: the ground with its objects, the
// planned course, the true path and the estimated path of the vehicle.

#include <optional>
#include <string>
#include <vector>

#include "rcs/zones/zones.h"
#include "sim/terrain/world.h"

namespace rcs::driving {

struct CourseSample {
  Vec2 place_world;  ///< ground truth
  double heading_rad = 0.0;
  double speed_mps = 0.0;
  bool gps = true;
  bool hit = false;  ///< a contact began
  std::optional<Vec2> estimated_world;
};

struct CoursePicture {
  const sim::World* world = nullptr;
  std::string title;
  std::vector<std::string> facts;  ///< lines under the title
  std::vector<Vec2> waypoints_world;
  double radius_m = 3.0;              ///< of the waypoints
  std::vector<CourseSample> samples;  ///< in order of time; at least two
  std::vector<std::vector<Vec2>> plans_world;
  struct ZoneBorder {
    std::vector<Vec2> ring_world;
    ZoneKind kind = ZoneKind::kKeepOut;
  };
  std::vector<ZoneBorder> zones_world;
  /// A candidate of the mission.
  struct Route {
    std::vector<Vec2> points_world;
    bool chosen = false;
  };
  std::vector<Route> routes_world;
  std::vector<std::vector<Vec2>> actors_world;  ///< paths of moving actors; at least a place each
};

/// A self-contained SVG file.
[[nodiscard]] std::string render(const CoursePicture& picture);

}  // namespace rcs::driving

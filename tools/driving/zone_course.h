#pragma once
// Operating zones of a closed-loop drive: drawn for a course, and judged by the ground truth.

#include <cstdint>
#include <string>
#include <vector>

#include "modules/bg/body.h"
#include "rcs/base/geodesy.h"
#include "rcs/base/linear.h"
#include "rcs/base/pose.h"
#include "rcs/zones/zones.h"

namespace rcs::driving {

/// A fence around a course, 40 m from its waypoints, and a keep-out of 6 to 16 m a side on each leg
/// but the first that is longer than 40 m: turned by any angle, up to 4 m beside its middle.
[[nodiscard]] std::vector<Zone> draw_zones(const std::vector<Vec2>& waypoints_world,
                                           std::uint64_t seed);

/// A GeoJSON file of zones in frame world.
[[nodiscard]] std::string to_geojson(const std::vector<Zone>& zones, const LocalFrame& world);

/// What the true outline of the vehicle did.
struct ZoneOutcome {
  bool judged = false;
  int entries = 0;  ///< into forbidden ground
  double min_clearance_m = 1e3;
};

class ZoneJudge {
 public:
  /// @param shape  of the vehicle
  ZoneJudge(const Zones& zones, const bg::Shape& shape) : zones_(zones), body_(shape, kExact_m) {
    outcome_.judged = !zones.empty();
  }
  void note(const Pose& T_world_vehicle);
  [[nodiscard]] const ZoneOutcome& outcome() const { return outcome_; }

 private:
  static constexpr double kExact_m = 30.0;  // larger clearances need not be exact
  const Zones& zones_;
  bg::Body body_;
  ZoneOutcome outcome_;
  bool inside_ = false;
};

}  // namespace rcs::driving

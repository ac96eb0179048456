#pragma once
// The parameters of the vehicle level, [mission].

#include <string>

#include "modules/mission/decide.h"
#include "modules/mission/route_map.h"
#include "modules/vj/route_value.h"
#include "rcs/node/node.h"
#include "rcs/node/params/params.h"
#include "rcs/prior/prior_terrain.h"
#include "rcs/zones/zone_file.h"

namespace rcs::mission {

/// Issuer of the commands and queries of the vehicle level.
constexpr char kIssuer[] = "mission";

struct MissionConfig {
  NodeInfo info{"mission", from_milliseconds(500.0), from_milliseconds(20.0)};
  Duration period = from_seconds(1.0);
  Duration command_valid = from_seconds(2.5);  ///< of a command to BG
  PriorTerrainParams prior;
  double map_memory_bytes = 0.0;
  GeodeticZones zones;
  RouteMapParams map;
  vj::RouteLimits limits;
  DecideParams decide;
  double speed_mps = 3.0;                 ///< by which the time of a route is predicted
  double max_speed_mps = 6.0;             ///< of the commands to BG, where the task states none
  double corridor_m = 12.0;               ///< radius of the places along a route
  double spacing_m = 40.0;                ///< of these places
  double way_back_m = 1.5;                ///< radius of the places of the way back
  double way_back_mps = 4.0;              ///< on the way back
  Duration gps_loss = from_seconds(5.0);  ///< GPS counts as lost
  /// Interval of the predictions of WM for the rest of a route that is driven.
  Duration predict_again = from_seconds(20.0);
};

[[nodiscard]] Result<MissionConfig> load_mission_config(const ParamFile& file);

}  // namespace rcs::mission

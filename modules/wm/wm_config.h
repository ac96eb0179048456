#pragma once
// Configuration of WM.

#include <optional>
#include <string_view>

#include "modules/wm/params.h"
#include "modules/wm/terrain/terrain_grid.h"
#include "rcs/base/geodesy.h"
#include "rcs/base/result.h"
#include "rcs/node/node.h"
#include "rcs/node/params/params.h"
#include "rcs/prior/prior_terrain.h"

namespace rcs::wm {

/// Predicted uncertainty along a path without GPS.
struct PathUncertaintyParams {
  double radius_m = 25.0;  ///< radius of the ground that a scan sees, and distance between matches
  double drift = 0.002;  ///< dead-reckoning error per metre without that of the heading, one sigma
};

struct WmConfig {
  NodeInfo info{"wm", from_milliseconds(15.0), from_milliseconds(1.0)};
  Duration period = from_milliseconds(20.0);  ///< of nav_state
  std::optional<Geodetic> datum;  ///< [world]: origin of frame world; none: the first fix
  TerrainParams terrain;          ///< [wm.terrain]
  Duration map_period = from_milliseconds(200.0);  ///< of map_patch
  PriorTerrainParams prior_terrain;        ///< [world]: prior_map and the other prior_* keys
  PathUncertaintyParams path_uncertainty;  ///< [wm.path_uncertainty]
  WmParams params;                         ///< [gps] [ins] [odometry] [wm.*]
};

/// Errors of an INS by its grade: "tactical", "industrial" or "consumer". Typical data-sheet values
/// (fibre-optic gyro and quartz; good MEMS; automotive MEMS).
[[nodiscard]] ProcessNoise ins_grade(std::string_view grade);

/// Reads [world], [gps], [ins], [odometry] and [wm]; ignores the tables of other nodes.
[[nodiscard]] Result<WmConfig> load_wm_config(const ParamFile& file);

}  // namespace rcs::wm

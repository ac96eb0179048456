#pragma once
// SP's part of a vehicle configuration.

#include <optional>
#include <string>

#include "modules/registration/point_to_plane_icp.h"
#include "modules/registration/rolling_map.h"
#include "modules/sp/degrade.h"
#include "modules/sp/motion_prediction.h"
#include "modules/sp/prior/prior_match.h"
#include "modules/sp/prior/prior_scan.h"
#include "modules/sp/scan/range_image.h"
#include "modules/sp/start/initial_localization.h"
#include "rcs/base/geodesy.h"
#include "rcs/base/result.h"
#include "rcs/node/budget.h"
#include "rcs/node/node.h"
#include "rcs/node/params/params.h"
#include "rcs/prior/prior_terrain.h"

namespace rcs::sp {

/// Where a vehicle is that starts without GPS.
struct StartPlace {
  Geodetic place;  ///< the height is of no matter
  double within_m = 100.0;
  double heading_rad = 0.0;                   ///< clockwise from north
  double heading_within_rad = radians(20.0);  ///< to either side
};

struct SpConfig {
  NodeInfo info{"sp", from_milliseconds(80.0), from_milliseconds(10.0)};
  PriorTerrainParams prior_terrain;  ///< [world]: prior_map and its like
  std::optional<Geodetic> datum;     ///< [world]: datum_*; read where [start] needs it
  std::optional<StartPlace> start;   ///< [start]; needs a map and a datum
  LadarParams ladar;                 ///< [ladar]

  double source_voxel_m = 0.5;    ///< one point a voxel is registered
  double map_voxel_m = 0.2;       ///< and one a voxel inserted in the map
  double publish_voxel_m = 0.15;  ///< and one published for WM's terrain
  double min_facets = 0.25;       ///< a scan with a smaller share of its facets is a failed one
  Duration facet_timeout = from_milliseconds(30.0);  ///< no facet for so long: take what came
  int reseed_after = 10;  ///< scans in a row without a registration start a new map

  ExpectationParams expectation;       ///< [sp]: coast_sigma_m and its like
  PriorScanParams prior_scan;          ///< [sp]: prior_column_m and its like
  registration::IcpParams icp;         ///< [sp.icp]
  registration::RollingMapParams map;  ///< [sp.map]
  PriorMatchParams prior;              ///< [sp.prior]
  RelocateParams relocate;             ///< [sp.relocate]
  GrantParams grant;                   ///< [sp.grant]
  DegradeParams degrade;               ///< [sp.degrade]
};

/// Reads [ladar], [sp] and [world]; tables of other nodes are not looked at.
[[nodiscard]] Result<SpConfig> load_sp_config(const ParamFile& file);

}  // namespace rcs::sp

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

/// Start region of a vehicle without GPS.
struct StartPlace {
  Geodetic place;  ///< its height is not used
  double within_m = 100.0;
  double heading_rad = 0.0;                   ///< clockwise from north
  double heading_within_rad = radians(20.0);  ///< to either side
};

struct SpConfig {
  NodeInfo info{"sp", from_milliseconds(80.0), from_milliseconds(10.0)};
  PriorTerrainParams prior_terrain;  ///< [world]: prior_map and related keys
  std::optional<Geodetic> datum;     ///< [world]: datum_*; read if [start] needs it
  std::optional<StartPlace> start;   ///< [start]; needs a map and a datum
  LadarParams ladar;                 ///< [ladar]

  double source_voxel_m = 0.5;    ///< one point of each voxel is registered
  double map_voxel_m = 0.2;       ///< and one of each is inserted in the map
  double publish_voxel_m = 0.15;  ///< and one of each is published for WM's terrain
  double min_facets = 0.25;       ///< a scan with a smaller share of its facets fails
  Duration facet_timeout = from_milliseconds(30.0);  ///< without a facet: the scan is processed
  int reseed_after = 10;  ///< failed registrations in a row after which a new map is started

  ExpectationParams expectation;                   ///< [sp]: coast_sigma_m and related keys
  PriorScanParams prior_scan;                      ///< [sp]: prior_column_m and related keys
  registration::IcpParams icp;                     ///< [sp.icp]
  registration::RollingMapParams map;              ///< [sp.map]
  PriorMatchParams prior;                          ///< [sp.prior]
  InitialLocalizationParams initial_localization;  ///< [sp.initial_localization]
  GrantParams grant;                               ///< [sp.grant]
  DegradeParams degrade;                           ///< [sp.degrade]
};

/// Reads [ladar], [start], [sp] and [world]; tables of other nodes are ignored.
[[nodiscard]] Result<SpConfig> load_sp_config(const ParamFile& file);

}  // namespace rcs::sp

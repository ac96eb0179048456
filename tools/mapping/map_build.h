#pragma once
// Builds a map of the ground from a run.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "tools/mapping/ground_builder.h"
#include "tools/mapping/mount_estimate.h"
#include "tools/mapping/standing_builder.h"
#include "tools/recording/run_scans.h"

namespace rcs::mapping {

struct MapBuild {
  std::string log;        ///< with poses
  std::string sensors;    ///< with the data of the LADAR; may be the same
  std::string pose_file;  ///< of PoseSource::kFile
  recording::PoseSource source = recording::PoseSource::kWm;
  std::optional<sp::LadarParams> ladar;  ///< nullopt: SP_POINTS
  double max_range_m = 30.0;             ///< farther returns are not used
  bool estimate_mount = true;
  std::optional<double> pose_sigma_m;  ///< of the heights of the poses; nullopt: from WM
  double pose_length_m = 200.0;        ///< correlation length of that error
  double memory_bytes = 4e9;           ///< limit
  std::uint16_t date = 0;              ///< days since 2000-01-01
  std::string reference = "WGS84";
  GroundBuilderParams ground;
  bool points = false;  ///< also surface points of above-ground structure
  StandingParams standing;
};

struct MapBuilt {
  MapFrame frame;
  GroundMetrics ground;
  recording::ScanCount scans;
  MountError mount;
  std::int64_t seen_through = 0;  ///< cells whose ground was invalid: seen through
  double bias_sigma_m = 0.0;
  std::int64_t points = 0;  ///< surface points of above-ground structure
};

/// @param frame  of the map; nullopt: that of the run
/// @param out  folder of the map; created when complete
/// @param progress  called with the completed share, [0, 1]; returns false to stop
[[nodiscard]] Result<MapBuilt> build_map(const MapBuild& wanted,
                                         const std::optional<MapFrame>& frame,
                                         const std::string& out,
                                         const std::function<bool(double)>& progress);

}  // namespace rcs::mapping

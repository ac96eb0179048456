#pragma once
// A map of the ground from runs.

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
  std::string sensors;    ///< with the LADAR's data; may be the same
  std::string pose_file;  ///< of PoseSource::kFile
  recording::PoseSource source = recording::PoseSource::kWm;
  std::optional<sp::LadarParams> ladar;  ///< none: SP_POINTS
  double max_range_m = 30.0;             ///< farther returns are not used
  bool estimate_mount = true;
  std::optional<double> pose_sigma_m;  ///< of the poses' heights; none: as WM says
  double pose_length_m = 200.0;        ///< over which that error changes
  double memory_bytes = 4e9;           ///< at most
  std::uint16_t date = 0;              ///< days since 2000-01-01
  std::string reference = "WGS84";
  GroundBuilderParams ground;
  bool points = false;  ///< also of what stands on the ground
  StandingParams standing;
};

struct MapBuilt {
  MapFrame frame;
  GroundFigures ground;
  recording::ScanCount scans;
  MountError mount;
  std::int64_t seen_through = 0;  ///< places whose ground was none
  double bias_sigma_m = 0.0;
  std::int64_t points = 0;  ///< of what stands on the ground
};

/// @param frame  of the map; none: the run's own
/// @param out  a map's folder; appears when it is complete
/// @param progress  told the share done, [0, 1]; says whether to go on
[[nodiscard]] Result<MapBuilt> build_map(const MapBuild& wanted,
                                         const std::optional<MapFrame>& frame,
                                         const std::string& out,
                                         const std::function<bool(double)>& progress);

}  // namespace rcs::mapping

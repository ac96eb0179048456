#pragma once
// Initial localization without GPS on the log of a drive: the points of SP and the poses of WM in
// frame local.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "modules/sp/start/initial_localization.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "tools/base/trajectory.h"

namespace rcs::studies {

/// The points of SP of one scan.
struct SeenScan {
  Stamp stamp;
  Pose T_level_vehicle;  ///< from WM, in frame local
  Points lowest_vehicle;
};

struct SeenDrive {
  std::vector<SeenScan> scans;
  tools::Trajectory truth;  ///< T_truthworld_vehicle; empty: not in the log
  std::optional<Geodetic> truth_datum;
};

/// Reads SP_POINTS, WM_NAV_STATE and SIM_TRUTH: the log of a run, or of `rcs replay`.
/// @param column_m  side of the columns whose lowest points are kept
[[nodiscard]] Result<SeenDrive> read_drive(const std::string& path, double column_m);

struct LocateResult {
  sp::InitialLocalizationStatus status;
  double after_s = 0.0;                ///< from the first scan to the result, or to the end
  Stamp stamp;                         ///< of the newest scan
  Pose T_map_vehicle;                  ///< at `stamp`, by the best candidate
  Mat<4> covariance = Mat<4>::Zero();  ///< of its x, y, z [m] and yaw [rad]
  WorkUnits used = 0;
};

/// Searches from the scan `first` on, until the start is found or the time is over.
/// @param per_scan  work units granted
/// @param progress  called with the share of the time that is searched; returns false to stop
[[nodiscard]] LocateResult locate(const SeenDrive& drive, std::size_t first, Duration length,
                                  const ElevationMap& map, const sp::StartRegion& region,
                                  WorkUnits per_scan, sp::InitialLocalizer* localizer,
                                  const std::function<bool(double)>& progress);

}  // namespace rcs::studies

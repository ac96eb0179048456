#pragma once
// A start without GPS, tried on the log of a drive: what SP saw, and where WM's smooth frame has
// it.

#include <optional>
#include <string>
#include <vector>

#include "modules/sp/start/initial_localization.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "tools/base/trajectory.h"

namespace rcs::studies {

/// What SP made of one scan.
struct SeenScan {
  Stamp stamp;
  Pose T_level_vehicle;  ///< WM's frame local
  Points lowest_vehicle;
};

struct SeenDrive {
  std::vector<SeenScan> scans;
  tools::Trajectory truth;  ///< T_truthworld_vehicle; empty: the log has none
  std::optional<Geodetic> truth_datum;
};

/// Reads SP_POINTS, WM_NAV_STATE and SIM_TRUTH: the log of a run, or of `rcs replay`.
/// @param column_m  of which the lowest points are kept
[[nodiscard]] Result<SeenDrive> read_drive(const std::string& path, double column_m);

struct LocateResult {
  sp::RelocateStatus status;
  double after_s = 0.0;                ///< from the first scan to the answer, or to the end
  Stamp stamp;                         ///< of the newest scan
  Pose T_map_vehicle;                  ///< then, by the best place
  Mat<4> covariance = Mat<4>::Zero();  ///< of its x, y, z [m] and yaw [rad]
  WorkUnits used = 0;
};

/// From the scan `first` on, for so long, or until it is found.
/// @param per_scan  work granted
[[nodiscard]] LocateResult locate(const SeenDrive& drive, std::size_t first, Duration length,
                                  const ElevationMap& map, const sp::StartRegion& region,
                                  WorkUnits per_scan, sp::Relocator* relocator);

}  // namespace rcs::studies

#pragma once
// The scans of a run in order, each with its pose.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "modules/sp/scan/range_image.h"
#include "rcs/base/geodesy.h"
#include "rcs/base/points.h"
#include "rcs/base/result.h"
#include "tools/base/trajectory.h"
#include "tools/recording/run_log.h"

namespace rcs::recording {

/// Source of the poses of scans.
enum class PoseSource { kWm, kTruth, kFile };

/// The file of sigmas that `rcs smooth` writes next to its poses: OUT.sigma.csv for OUT and
/// OUT.scans.
[[nodiscard]] std::string sigma_file_of(const std::string& pose_file);

/// Poses of the vehicle.
struct RunPoses {
  tools::Trajectory world;   ///< T_world_vehicle
  tools::Trajectory smooth;  ///< T_any_vehicle, without steps, for deskewing
  Geodetic datum;            ///< of frame world
  double sigma_up_m =
      0.0;  ///< root mean square of the sigmas of height, of WM or from the sigma file
};

/// @param file  of PoseSource::kFile: TUM, in frame world of WM (else of the truth) in `run`
/// @return an error that names the missing data
[[nodiscard]] Result<RunPoses> poses_of(const RunLog& run, PoseSource source,
                                        const std::string& file);

/// A scan, or a part of one.
struct PlacedScan {
  Stamp reference;
  std::uint32_t number = 0;  ///< of the scan within the run, the same for its parts
  Points p_vehicle;          ///< [m], finite, deskewed to the reference instant
  Pose T_world_vehicle;
  Vec6 twist_vehicle = Vec6::Zero();  ///< (rho [m/s], phi [rad/s])
};

/// Counts of the LADAR data of a log.
struct ScanCount {
  std::int64_t scans = 0;    ///< placed
  std::int64_t no_pose = 0;  ///< scans that the poses do not cover
  std::int64_t points = 0;   ///< of the placed ones
  std::int64_t bad = 0;      ///< malformed messages or points
  std::string damage;        ///< of the log; empty: none
};

/// Calls `use` with every scan; it returns false to stop.
/// @param ladar  as configured: LADAR_RANGES and LADAR_POINTS are converted. nullopt: SP_POINTS
/// @param progress  called with the share of the log that was read; returns false to stop
/// @return an error if the log can't be read, and "interrupted"
[[nodiscard]] Result<ScanCount> for_each_scan(const std::string& log, const RunPoses& poses,
                                              const std::optional<sp::LadarParams>& ladar,
                                              const std::function<void(const PlacedScan&)>& use,
                                              const std::function<bool(double)>& progress);

}  // namespace rcs::recording

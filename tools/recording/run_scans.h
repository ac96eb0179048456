#pragma once
// The scans of a run, one after the other, each with the pose that it was taken at.

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

/// Whose poses scans are placed by.
enum class PoseSource { kWm, kTruth, kFile };

/// The file of sigmas that `rcs truth` writes beside its poses: OUT.sigma.csv for OUT and
/// OUT.scans.
[[nodiscard]] std::string sigma_file_of(const std::string& pose_file);

/// Where the vehicle was.
struct RunPoses {
  tools::Trajectory world;   ///< T_world_vehicle
  tools::Trajectory smooth;  ///< T_any_vehicle, without steps: what a scan is deskewed by
  Geodetic datum;            ///< of frame world
  double sigma_up_m = 0.0;   ///< root mean square of the heights' sigmas: WM's, or the sigma file's
};

/// @param file  of PoseSource::kFile: TUM, in frame world of WM (else of the truth) in `run`
/// @return an error that says what the log lacks
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

/// What became of a log's LADAR data.
struct ScanCount {
  std::int64_t scans = 0;    ///< placed
  std::int64_t no_pose = 0;  ///< scans that the poses do not cover
  std::int64_t points = 0;   ///< of the placed ones
  std::int64_t bad = 0;      ///< messages or points that are not what they should be
  std::string damage;        ///< of the log; empty: none
};

/// Calls `use` with every scan; it says whether to go on.
/// @param ladar  as configured: LADAR_RANGES and LADAR_POINTS are converted. None: SP_POINTS, as SP
///   published them
/// @param progress  told the share of the log that was read; says whether to go on
/// @return an error when the log can't be read, and "interrupted"
[[nodiscard]] Result<ScanCount> for_each_scan(const std::string& log, const RunPoses& poses,
                                              const std::optional<sp::LadarParams>& ladar,
                                              const std::function<void(const PlacedScan&)>& use,
                                              const std::function<bool(double)>& progress);

}  // namespace rcs::recording

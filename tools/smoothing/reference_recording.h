#pragma once
// Input of the smoother: scans, inertial samples, fixes and wheel samples of a recorded run, and
// the online motion of WM.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "modules/sp/sp_config.h"
#include "modules/wm/wm_config.h"
#include "rcs/base/geodesy.h"
#include "rcs/base/points.h"
#include "rcs/base/result.h"
#include "tools/base/trajectory.h"
#include "tools/smoothing/preintegration.h"

namespace rcs::smoothing {

struct RecordedScan {
  Stamp reference;
  Points points_vehicle;  ///< deskewed to the reference instant, by the configured mount
};

/// Online result of SP for a scan, matched to the rolling map.
struct RecordedMatch {
  Stamp reference;
  std::int32_t map_epoch = 0;
  Pose T_rolling_vehicle;
};

struct RecordedBelief {
  Stamp stamp;
  bool world_valid = false;
  Pose T_world_vehicle;
  Pose T_local_vehicle;
  Mat6 cov_world_pose = Mat6::Identity();
  Vec3 v_vehicle = Vec3::Zero();
  Vec3 rate_vehicle = Vec3::Zero();
  Vec3 gyro_bias = Vec3::Zero();
  Vec3 accel_bias = Vec3::Zero();
};

struct RecordedFix {
  Stamp stamp;
  Vec3 p_world = Vec3::Zero();  ///< of the antenna
  Vec3 sigma_m = Vec3::Ones();
  bool has_velocity = false;
  Vec3 v_world = Vec3::Zero();
  Vec3 sigma_mps = Vec3::Ones();
};

struct RecordedWheels {
  Stamp end;
  double interval_s = 0.0;
  double speed_mps = 0.0;
  double sigma_mps = 0.0;
};

/// By stamp, strictly ascending; messages with stamps that run backward or non-finite values are
/// counted and skipped.
struct ReferenceRecording {
  std::vector<RecordedScan> scans;
  std::vector<RecordedMatch> matches;
  std::vector<RecordedBelief> beliefs;
  std::vector<InertialIncrement> inertial;
  std::vector<RecordedFix> fixes;
  std::vector<RecordedWheels> wheels;
  tools::Trajectory sim_truth;    ///< in frame world; only for the report
  std::optional<Geodetic> datum;  ///< of frame world; nullopt: no GPS, the frame is local
  std::int64_t refused = 0;
  std::string damage;  ///< of the log; empty: none
};

struct ReferenceVehicle {
  sp::SpConfig sp;
  wm::WmConfig wm;
};

/// Runs SP and WM on the sensor data of the log in lockstep, as `rcs replay`.
/// @param progress  (bytes done, total bytes)
/// @return an error if the log has no scans, or `stop` returned true
[[nodiscard]] Result<ReferenceRecording> record_run(
    const std::string& log, const ReferenceVehicle& vehicle,
    const std::function<void(std::int64_t, std::int64_t)>& progress,
    const std::function<bool()>& stop);

}  // namespace rcs::smoothing

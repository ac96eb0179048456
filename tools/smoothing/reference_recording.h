#pragma once
// What a recorded run tells of a drive: its scans, inertial samples, fixes and wheels as measured,
// and the motion that WM made of them as it went.

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

/// SP's own answer for a scan, against the map that it made as it went.
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

/// By stamp, strictly ascending; what ran backward or was no number is counted and left out.
struct TruthRecording {
  std::vector<RecordedScan> scans;
  std::vector<RecordedMatch> matches;
  std::vector<RecordedBelief> beliefs;
  std::vector<InertialIncrement> inertial;
  std::vector<RecordedFix> fixes;
  std::vector<RecordedWheels> wheels;
  tools::Trajectory sim_truth;    ///< in frame world; for the report alone
  std::optional<Geodetic> datum;  ///< of frame world; none: no GPS, the frame is local
  std::int64_t refused = 0;
  std::string damage;  ///< of the log; empty: none
};

struct TruthVehicle {
  sp::SpConfig sp;
  wm::WmConfig wm;
};

/// Runs SP and WM on the log's sensor data in lockstep, as `rcs replay` does.
/// @param progress  (bytes done, bytes in all)
/// @return an error when the log has no scans, or `stop` said so
[[nodiscard]] Result<TruthRecording> record_run(
    const std::string& log, const TruthVehicle& vehicle,
    const std::function<void(std::int64_t, std::int64_t)>& progress,
    const std::function<bool()>& stop);

}  // namespace rcs::smoothing

#pragma once
// The record of a run of a drill: all data for the metrics, received from the bus during the run.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"
#include "tools/base/trajectory.h"

namespace rcs::drills {

/// A belief of WM. Stamps are of the undisturbed clocks.
struct DrillBelief {
  Stamp stamp;
  Pose T_world_vehicle;  ///< in frame world of the truth
  Pose T_local_vehicle;
  Vec3 v_local = Vec3::Zero();      ///< [m/s]
  Vec3 accel_local = Vec3::Zero();  ///< [m/s^2]
  Vec3 gyro_bias_radps = Vec3::Zero();
  Vec3 accel_bias_mps2 = Vec3::Zero();
  double wheel_scale = 1.0;  ///< measured wheel speed over true speed
  Mat6 cov_world_pose = Mat6::Zero();
  Vec3 v_world = Vec3::Zero();  ///< in frame world of the truth [m/s]
  Mat3 cov_v_world = Mat3::Zero();
  std::int8_t mode = 0;
};

struct DrillFix {
  Stamp stamp;
  Stamp arrival;
  std::int64_t utime = 0;       ///< as received by WM
  Vec3 p_world = Vec3::Zero();  ///< antenna, in frame world of the truth; not finite: no position
  Vec3 sigma_m = Vec3::Zero();  ///< reported, east north up
};

struct DrillInnovation {
  Stamp stamp;
  Stamp arrival;
  std::int64_t utime = 0;
  std::int8_t source = 0;
  bool accepted = false;
  std::int8_t reason = 0;
  int dof = 0;
  double nis = 0.0;
  Vec6 normalized = Vec6::Zero();  ///< components divided by their sigmas; 0 beyond dof
};

struct DrillIntegrity {
  Stamp stamp;
  double horizontal_m = 0.0;  ///< protection levels
  double vertical_m = 0.0;
  double limit_horizontal_m = 0.0;
  double limit_vertical_m = 0.0;
  int alerts = 0;
  int gps = 0;  ///< STATUS_*
  int ladar = 0;
};

/// Result of SP for a scan matched to the rolling map.
struct DrillMatch {
  Stamp stamp;  ///< reference instant of the scan
  std::int32_t epoch = 0;
  Pose T_rolling_vehicle;
};

struct DrillSubfilter {
  Stamp stamp;
  Stamp branch;
  int kind = 0;          ///< subfilter_t::KIND_*
  Pose T_world_vehicle;  ///< in frame world of the truth
};

struct DrillEvent {
  Stamp time;  ///< time of the log, converted to the sensor time of the record
  std::string node;
  int severity = 0;
  std::string code;
  std::string text;
};

struct DrillRecord {
  std::optional<Stamp> begin;  ///< stamp of the first sensor message
  Stamp end;                   ///< of the last one
  tools::Trajectory
      truth;  ///< T_world_vehicle; for a log without SIM_TRUTH the belief of another run
  std::vector<Vec3> v_truth_world;   ///< for each of `truth` [m/s]; empty: unknown
  std::vector<DrillBelief> beliefs;  ///< with a valid world, in the order of publication
  std::vector<DrillFix> fixes;
  std::vector<DrillInnovation> innovations;
  std::vector<DrillIntegrity> integrity;
  std::vector<DrillSubfilter> subfilters;
  std::vector<DrillEvent> events;
  std::vector<DrillMatch> matches;   ///< valid ones, in the order of publication
  std::map<std::string, int> stops;  ///< of the registrations to the rolling map
  std::int64_t overruns = 0;
  std::int64_t missed = 0;
  std::uint64_t hash = 0;  ///< FNV-1a of the messages of the nodes, in order
  Vec3 p_vehicle_antenna = Vec3::Zero();
};

}  // namespace rcs::drills

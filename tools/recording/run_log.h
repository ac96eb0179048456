#pragma once
// A run from its log: results of SP and WM, the truth if present, and the computing times of the
// cycles.

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "tools/base/trajectory.h"

namespace rcs::recording {

/// Result of SP for one scan matched to the rolling map.
struct ScanRecord {
  Stamp reference;
  std::int64_t scan_id = 0;
  std::int32_t map_epoch = 0;
  std::int8_t stop = 0;                   ///< registration_t::STOP_*
  std::optional<Pose> T_rolling_vehicle;  ///< nullopt: invalid
  int iterations = 0;
};

struct NavRecord {
  Stamp stamp;
  bool world_valid = false;
  Pose T_world_vehicle;
  Pose T_local_vehicle;
  Mat6 cov_world_pose = Mat6::Zero();  ///< right perturbation (rho, phi)
  Duration age_gps{};                  ///< negative: never accepted
  Duration age_ins{};                  ///< negative: never accepted
  Stamp cause_arrival;                 ///< node time; utime 0: none
  Stamp published;                     ///< node time
};

/// A measurement that WM accepted.
struct FusedRecord {
  Stamp stamp;
  std::int8_t source = 0;  ///< innovation_t::SOURCE_*
};

/// Computing times of one cycle of a node.
struct CycleRecord {
  double late_ms = 0.0;
  double wall_ms = 0.0;
  double slack_ms = 0.0;
  std::vector<std::pair<std::string, double>> stages_ms;
};

struct NodeRecord {
  std::vector<CycleRecord> cycles;
  std::int64_t missed = 0;
  std::int64_t overruns = 0;
  std::map<std::string, std::int64_t> lost;  ///< by input channel: dropped + missing in seq
};

struct RunLog {
  std::string path;
  std::vector<ScanRecord> scans;        ///< by reference instant
  std::vector<NavRecord> nav;           ///< by stamp, strictly; of equal stamps the last published
  std::vector<FusedRecord> fused;       ///< in the order of the log
  std::int64_t prior_matches = 0;       ///< converged against the a priori map
  std::optional<Geodetic> world_datum;  ///< of WM's frame world
  tools::Trajectory truth;              ///< T_truthworld_vehicle
  std::optional<Geodetic> truth_datum;
  std::map<std::string, NodeRecord> nodes;  ///< by name; live, or from the file LOG.timing
  bool live = false;                        ///< the computing times are of a live run
  std::int64_t undecodable = 0;
  std::string damage;  ///< of the log; empty: none
};

/// Reads the log of a run, and LOG.timing if that exists and the log has no cycle messages.
/// @param progress  called with the share of the log that is read; returns false to stop
[[nodiscard]] Result<RunLog> read_run(
    const std::string& path,
    const std::function<bool(double)>& progress = [](double) { return true; });

/// Keeps scans, beliefs and truth within [from, to) after the earliest.
void cut(Duration from, Duration to, RunLog* run);

/// The name of a registration_t::STOP_*.
[[nodiscard]] std::string_view stop_name(int stop);

enum class Frame { kWorld, kLocal, kRolling };

struct ScanPoses {
  std::vector<std::int64_t> scan_ids;
  tools::Trajectory poses;  ///< T_frame_vehicle at the reference instants of the scans
  std::size_t carried = 0;  ///< not covered by WM: extrapolated by the rolling map of SP
};

/// Pose of the vehicle at the reference instant of every scan. World and local: the belief of WM,
/// interpolated along the screw motion; a scan outside the beliefs (before the first one) is
/// extrapolated by the rolling map of SP from the nearest scan inside. A run without scans (no
/// LADAR) has poses at the stamps of WM, numbered from 0.
/// @return an error if the frame never existed, or the rolling poses are of several maps
[[nodiscard]] Result<ScanPoses> poses_at_scans(const RunLog& run, Frame frame);

/// The sensor time of the first event of a log, from the first WM_NAV_STATE or SIM_TRUTH; the
/// viewer counts from this event.
/// @return nullopt: the log has neither
[[nodiscard]] std::optional<Stamp> begin_in_sensor_time(const std::string& path);

}  // namespace rcs::recording

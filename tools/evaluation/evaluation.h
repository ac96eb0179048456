#pragma once
// The metrics of a run: errors against the truth, consistency with its covariances, and cycle
// times.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/base/statistics.h"
#include "tools/evaluation/trajectory_error.h"
#include "tools/recording/run_log.h"

namespace rcs::evaluation {

/// Interval of sensor time.
struct TimeInterval {
  Stamp from;
  Stamp to;

  [[nodiscard]] bool contains(Stamp t) const { return t >= from && t < to; }
};

/// Standard deviations of the world pose in the axes of frame world.
struct WorldSigma {
  Vec3 position_m = Vec3::Zero();
  double horizontal_m = 0.0;  ///< in the worst direction
  double heading_rad = 0.0;
};

/// @param R_world_vehicle  attitude of the pose
/// @param cov_world_pose  right perturbation (rho, phi)
[[nodiscard]] WorldSigma world_sigma(const Mat3& R_world_vehicle, const Mat6& cov_world_pose);

/// Errors of the world pose at one instant and published sigmas, in the axes of frame world of the
/// truth.
struct WorldError {
  Stamp stamp;
  Pose T_truthworld_vehicle;       ///< the estimate
  Vec3 position_m = Vec3::Zero();  ///< estimate - truth
  double heading_rad = 0.0;
  Vec3 sigma_m = Vec3::Zero();
  double sigma_horizontal_m = 0.0;  ///< in the worst direction
  double sigma_heading_rad = 0.0;
  std::optional<double> nees;  ///< 6 degrees of freedom

  [[nodiscard]] double horizontal_m() const { return position_m.head<2>().norm(); }
};

/// Errors of the world pose at 10 Hz, while valid.
struct WorldMetrics {
  std::vector<WorldError> errors;
  tools::Summary horizontal_m;
  tools::Summary vertical_m;
  tools::Summary heading_rad;
  double nees_per_dof = 0.0;  ///< mean; 1 for a consistent covariance
  std::size_t nees_samples = 0;
  std::size_t not_positive_definite = 0;
  double horizontal_within_3_sigma = 0.0;  ///< share of the time
  double vertical_within_3_sigma = 0.0;
  double heading_within_3_sigma = 0.0;
};

/// Errors in a GPS outage.
struct OutageMetrics {
  TimeInterval interval;
  double driven_m = 0.0;
  tools::Summary horizontal_m;  ///< over the whole outage
  double end_horizontal_m = 0.0;
  double start_horizontal_m = 0.0;
  double drift_percent =
      0.0;  ///< horizontal error at the end in percent of the distance driven in it
  double nees_per_dof = 0.0;
};

struct TrajectoryMetrics {
  std::size_t pairs = 0;
  double driven_m = 0.0;
  AbsoluteError rigid;  ///< after alignment over SE(3)
  AbsoluteError yaw;    ///< over position and yaw
  AbsoluteError unaligned;
  double drift_percent = 0.0;
  RelativeError per_10_frames;
  std::vector<RelativeError> per_length;
  RelativeError lengths_mean;  ///< over all segments of all lengths, as KITTI ranks
};

struct NodeMetrics {
  tools::Summary wall_ms;
  tools::Summary late_ms;
  std::map<std::string, tools::Summary> stages_ms;
  std::int64_t missed = 0;
  std::int64_t overruns = 0;
  std::map<std::string, std::int64_t> lost;
};

struct RunMetrics {
  std::size_t scans = 0;
  std::size_t scans_missing = 0;  ///< in scan_id
  std::map<std::string, std::size_t> stops;
  tools::Summary iterations;
  std::int64_t prior_matches = 0;
  std::map<std::string, NodeMetrics> nodes;
  /// From the arrival of the last facet of a scan to the publication of the first belief that uses
  /// it; live.
  std::optional<tools::Summary> chain_ms;
  std::vector<double> chain_samples_ms;
};

[[nodiscard]] RunMetrics run_metrics(const recording::RunLog& run);

/// @param pairs  estimate and truth at the scans
[[nodiscard]] TrajectoryMetrics trajectory_metrics(const PosePairs& pairs);

/// nullopt without a truth, a datum, or a valid world pose.
[[nodiscard]] std::optional<WorldMetrics> world_metrics(const recording::RunLog& run,
                                                        const tools::Trajectory& truth,
                                                        const std::optional<Geodetic>& truth_datum);

/// Intervals longer than 2.5 s in which WM accepted no fix: from the last one to the next.
[[nodiscard]] std::vector<TimeInterval> gps_outages(const recording::RunLog& run);

/// The intersection of two lists of intervals, each in order and disjoint.
[[nodiscard]] std::vector<TimeInterval> common_intervals(const std::vector<TimeInterval>& a,
                                                         const std::vector<TimeInterval>& b);

/// Sources that WM fused within `interval`, its ends excluded: the INS if its data was not older
/// than 1 s, any other source if WM accepted a measurement of it. In the fixed names and order of
/// "GPS", "LADAR", "a priori map", "wheel encoders", "INS" and "motion constraints" (the
/// non-holonomic one, and zero velocity at standstill).
[[nodiscard]] std::vector<std::string> fused_sources(const recording::RunLog& run,
                                                     const TimeInterval& interval);

[[nodiscard]] OutageMetrics outage_metrics(const WorldMetrics& metrics, const TimeInterval& outage);

/// Frame world of WM in frame world of the truth: tangent planes at different datums.
[[nodiscard]] Pose between_worlds(const Geodetic& truth_datum, const Geodetic& world_datum);

/// Poses in one frame world in that of another datum. A datum that is no place on the earth: as
/// they were.
void move_between_worlds(const Geodetic& to, const Geodetic& from, tools::Trajectory* poses);

}  // namespace rcs::evaluation

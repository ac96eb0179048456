#pragma once
// Metrics of one run of a drill: errors and smoothness. Pure functions of a record.

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/drills/drill_record.h"
#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// Error of a belief.
struct DrillError {
  double t_s = 0.0;
  Vec3 position_m = Vec3::Zero();  ///< belief - truth, frame world
  double along_m = 0.0;            ///< in the direction of the vehicle's heading
  double across_m = 0.0;           ///< to its left
  double heading_rad = 0.0;
  double sigma_horizontal_m = 0.0;  ///< published, in the worst direction
  std::optional<double> nees;       ///< 6 degrees of freedom

  [[nodiscard]] double horizontal_m() const { return position_m.head<2>().norm(); }
  [[nodiscard]] double vertical_m() const { return std::abs(position_m.z()); }
};

/// Looks up beliefs and their errors by time. The record outlives it.
class DrillErrors {
 public:
  explicit DrillErrors(const DrillRecord& record);

  /// Error of the last belief not later than `stamp` and at most 0.5 s older.
  [[nodiscard]] std::optional<DrillError> at(Stamp stamp) const;
  [[nodiscard]] const DrillBelief* belief_at(Stamp stamp) const;
  /// nullopt if the truth is unknown.
  [[nodiscard]] std::optional<DrillError> of(const DrillBelief& belief) const;
  [[nodiscard]] std::optional<Pose> truth_at(Stamp stamp) const;
  /// Distance driven between two moments, by the truth.
  [[nodiscard]] double driven_m(Stamp from, Stamp to) const;
  [[nodiscard]] double time_s(Stamp stamp) const;
  [[nodiscard]] Stamp stamp_at(double t_s) const;
  /// Errors at 10 Hz.
  [[nodiscard]] std::vector<DrillError> sampled() const;

 private:
  const DrillRecord& record_;
  std::vector<const DrillBelief*> by_stamp_;
};

struct OutageDrift {
  DrillWindow window;
  double driven_m = 0.0;
  double start_m = 0.0;  ///< horizontal error
  double end_m = 0.0;
  double heading_start_rad = 0.0;
  double drift_pct = 0.0;  ///< end_m in percent of driven_m; 0 at rest (under 10 m)
  double m_per_min = 0.0;
};

struct SmoothStep {
  double m = 0.0;  ///< beyond the motion predicted from the belief before
  double t_s = 0.0;
};

struct NisMetric {
  std::size_t considered = 0;
  std::size_t gated = 0;  ///< those with a NIS
  std::size_t accepted = 0;
  double per_dof = 0.0;  ///< mean of the gated ones; 1 for a consistent filter
};

struct AccuracyMetrics {
  double cep50_m = 0.0;
  double cep95_m = 0.0;
  double vertical95_m = 0.0;
  double horizontal_max_m = 0.0;
  double along_rms_m = 0.0;
  double across_rms_m = 0.0;
  double nees_per_dof = 0.0;
  std::size_t samples = 0;
};

/// Intervals in which GPS is denied.
[[nodiscard]] std::vector<DrillWindow> gps_outages_of(const Drill& drill);
[[nodiscard]] std::vector<OutageDrift> outage_drifts(const Drill& drill, const DrillRecord& record,
                                                     const DrillErrors& errors);
/// From the begin of the first stimulus to the end of the run.
[[nodiscard]] AccuracyMetrics accuracy(const Drill& drill, const DrillErrors& errors);
[[nodiscard]] SmoothStep largest_smooth_step(const Drill& drill, const DrillRecord& record);
/// By name of the source in innovation_t.
[[nodiscard]] std::map<std::string, NisMetric> nis_metrics(const DrillRecord& record);

/// Accepted or rejected by the gate: the NIS is valid.
[[nodiscard]] bool has_nis(const DrillInnovation& innovation);

}  // namespace rcs::drills

#pragma once
// The figures of one run of a drill: how far off it was, and how smooth. Pure functions of a
// record.

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/drills/drill_record.h"
#include "tools/drills/drill_spec.h"

namespace rcs::drills {

/// A belief against the truth.
struct DrillError {
  double t_s = 0.0;
  Vec3 position_m = Vec3::Zero();  ///< belief - truth, frame world
  double along_m = 0.0;            ///< in the direction of the vehicle's heading
  double across_m = 0.0;           ///< to its left
  double heading_rad = 0.0;
  double sigma_horizontal_m = 0.0;  ///< that WM claims, along the worst direction
  std::optional<double> nees;       ///< 6 degrees of freedom

  [[nodiscard]] double horizontal_m() const { return position_m.head<2>().norm(); }
  [[nodiscard]] double vertical_m() const { return std::abs(position_m.z()); }
};

/// Looks up beliefs and their errors by time. The record outlives it.
class DrillErrors {
 public:
  explicit DrillErrors(const DrillRecord& record);

  /// Of the last belief not later than `stamp` and not more than 0.5 s older.
  [[nodiscard]] std::optional<DrillError> at(Stamp stamp) const;
  [[nodiscard]] const DrillBelief* belief_at(Stamp stamp) const;
  /// None where the truth is not known.
  [[nodiscard]] std::optional<DrillError> of(const DrillBelief& belief) const;
  [[nodiscard]] std::optional<Pose> truth_at(Stamp stamp) const;
  /// Driven between two moments, by the truth.
  [[nodiscard]] double driven_m(Stamp from, Stamp to) const;
  [[nodiscard]] double time_s(Stamp stamp) const;
  [[nodiscard]] Stamp stamp_at(double t_s) const;
  /// Ten a second.
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
  double drift_pct = 0.0;  ///< end_m of driven_m; at rest (under 10 m) 0
  double m_per_min = 0.0;
};

struct SmoothStep {
  double m = 0.0;  ///< beyond the motion predicted from the belief before
  double t_s = 0.0;
};

struct NisFigure {
  std::size_t considered = 0;
  std::size_t gated = 0;  ///< of these, with a NIS
  std::size_t accepted = 0;
  double per_dof = 0.0;  ///< mean of the gated ones; 1 when WM knows its errors
};

struct AccuracyFigures {
  double cep50_m = 0.0;
  double cep95_m = 0.0;
  double vertical95_m = 0.0;
  double horizontal_max_m = 0.0;
  double along_rms_m = 0.0;
  double across_rms_m = 0.0;
  double nees_per_dof = 0.0;
  std::size_t samples = 0;
};

/// Where GPS is withheld.
[[nodiscard]] std::vector<DrillWindow> gps_outages_of(const Drill& drill);
[[nodiscard]] std::vector<OutageDrift> outage_drifts(const Drill& drill, const DrillRecord& record,
                                                     const DrillErrors& errors);
/// From the drill's begin to the end of the run.
[[nodiscard]] AccuracyFigures accuracy(const Drill& drill, const DrillErrors& errors);
[[nodiscard]] SmoothStep largest_smooth_step(const Drill& drill, const DrillRecord& record);
/// By source, as innovation_t names it in words.
[[nodiscard]] std::map<std::string, NisFigure> nis_figures(const DrillRecord& record);

/// Taken, or refused by the gate: its NIS means something.
[[nodiscard]] bool has_nis(const DrillInnovation& innovation);

}  // namespace rcs::drills

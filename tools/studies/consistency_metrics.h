#pragma once
// Is what WM says of its own error true? Errors of position, velocity and attitude against the
// covariances published with them, and innovations against what was predicted of them. Pure
// functions of the records of many runs.

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/drills/drill_record.h"
#include "tools/drills/drill_result.h"

namespace rcs::studies {

/// Parts of the state that are judged by themselves.
enum class StatePart { kPosition, kVelocity, kAttitude };
constexpr std::array<StatePart, 3> kStateParts = {StatePart::kPosition, StatePart::kVelocity,
                                                  StatePart::kAttitude};
constexpr double kPartDof = 3.0;  ///< degrees of freedom of each
[[nodiscard]] std::string_view part_name(StatePart part);

/// The drive, and when it is looked at: seconds since the first sensor message.
struct ConsistencyPlan {
  double outage_begin_s = 35.0;                    ///< GPS is cut from here to the end
  std::vector<double> times_s = {30, 45, 65, 95};  ///< ascending

  /// The drill that does this, without marks.
  [[nodiscard]] drills::Drill drill(const std::string& scenario, const std::string& ins) const;
  /// Into the outage; none: GPS is there.
  [[nodiscard]] std::optional<double> into_outage_s(double t_s) const;
};

/// Of one part at one moment.
struct PartError {
  double error = 0.0;    ///< magnitude [m, m/s, rad]
  double claimed = 0.0;  ///< root of the covariance's trace, in the same unit
  double nees = 0.0;     ///< expected 3
};
/// None: no belief, no truth, or a covariance that is none.
using PartErrors = std::array<std::optional<PartError>, kStateParts.size()>;

/// @param v_truth_world  [m/s]; none: velocity is not known
[[nodiscard]] PartErrors part_errors(const drills::DrillBelief& belief,
                                     const Pose& T_world_vehicle_truth,
                                     const std::optional<Vec3>& v_truth_world);

/// Of one source's measurements with a NIS (has_nis()).
struct InnovationSums {
  std::size_t count = 0;
  std::size_t refused = 0;  ///< of these, by the gate
  double nis_per_dof = 0.0;
  double lagged = 0.0;  ///< sum of z_i z_j over components and successive measurements i, j
  double square = 0.0;  ///< sum of (z_i^2 + z_j^2) / 2 over the same

  void add(const InnovationSums& more);
  /// 1 when WM knows its errors.
  [[nodiscard]] double mean_nis_per_dof() const;
  /// Correlation of successive normalized innovations, in [-1, 1]; 0 when they are white. None: no
  /// two successive ones.
  [[nodiscard]] std::optional<double> lag1() const;
};
/// By source, as innovation_t names it in words.
using Innovations = std::map<std::string, InnovationSums>;

/// Successive: of one source and size, both with a NIS, at most 2 s apart.
[[nodiscard]] Innovations innovation_sums(const std::vector<drills::DrillInnovation>& innovations);

/// What is left of one run.
struct ConsistencyRun {
  std::int64_t seed = 0;
  std::vector<PartErrors> at;     ///< at the plan's times
  std::vector<PartErrors> curve;  ///< at 0, 1, 2 ... s, up to the last of the plan's times
  Innovations innovations;
  std::optional<drills::IntegrityFigures> integrity;  ///< of the outage; none: not published
};
[[nodiscard]] ConsistencyRun consistency_run(const ConsistencyPlan& plan, std::int64_t seed,
                                             const drills::DrillRecord& record);

/// Runs of one scenario and one grade of INS.
struct ConsistencyBlock {
  std::string scenario;  ///< path
  std::string ins;       ///< grade
  std::vector<ConsistencyRun> runs;
  std::string error;  ///< it could not be run; empty: it was

  [[nodiscard]] bool was_run() const { return error.empty() && !runs.empty(); }
};

struct ValueInterval {
  double low = 0.0;
  double high = 0.0;

  [[nodiscard]] bool contains(double v) const { return v >= low && v <= high; }
};
constexpr ValueInterval kNeesMark = {0.5, 1.5};      ///< mean NEES per degree of freedom
constexpr ValueInterval kInsideMark = {0.88, 0.99};  ///< share of truths inside the 95 % ellipsoid
constexpr ValueInterval kNisMark = {0.4, 1.3};  ///< mean NIS per degree of freedom, before gating

/// Mean of chi-square values of `dof` degrees in all, per degree: what `z` sigma of chance leave of
/// an honest filter's 1 (Wilson and Hilferty 1931).
/// @param dof  > 0
[[nodiscard]] ValueInterval chance_of_mean(double dof, double z);

/// One part over the runs of a block.
struct PartFigure {
  std::size_t count = 0;
  std::size_t missing = 0;  ///< runs that say nothing there
  double nees_per_dof = 0.0;
  double inside = 0.0;  ///< share inside the 95 % ellipsoid
  double rms_error = 0.0;
  double rms_claimed = 0.0;
};
[[nodiscard]] PartFigure figure_at(const ConsistencyBlock& block, std::size_t time, StatePart part);
[[nodiscard]] PartFigure figure_at_second(const ConsistencyBlock& block, std::size_t second,
                                          StatePart part);
/// Over all of the plan's times.
[[nodiscard]] PartFigure figure_of_all(const ConsistencyBlock& block, StatePart part);
[[nodiscard]] Innovations pooled_innovations(const ConsistencyBlock& block);

/// Over the runs' outages.
struct ProtectionFigure {
  std::size_t samples = 0;
  double within_horizontal = 0.0;  ///< share of the time with the error within the level
  double within_vertical = 0.0;
  int missed_alerts = 0;
  double false_alerts_per_h = 0.0;  ///< while GPS is there
};
[[nodiscard]] ProtectionFigure protection(const ConsistencyBlock& block);

/// Outside of its mark a figure fails; with fewer than 20 runs (measurements, of a NIS: 100), only
/// when chance does not take an honest filter's so far, and is open else.
[[nodiscard]] drills::Verdict nees_verdict(const PartFigure& f);
[[nodiscard]] drills::Verdict inside_verdict(const PartFigure& f, std::size_t runs);
[[nodiscard]] drills::Verdict nis_verdict(const InnovationSums& sums);

/// kFail when anything fails, or could not be run.
[[nodiscard]] drills::Verdict verdict_of(const ConsistencyPlan& plan,
                                         const ConsistencyBlock& block);

}  // namespace rcs::studies

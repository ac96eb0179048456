#pragma once
// Filter consistency: errors of position, velocity and attitude of WM normalized by the published
// covariances, and normalized innovations. Pure functions of the records of many runs.

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

/// Parts of the state that are judged separately.
enum class StatePart { kPosition, kVelocity, kAttitude };
constexpr std::array<StatePart, 3> kStateParts = {StatePart::kPosition, StatePart::kVelocity,
                                                  StatePart::kAttitude};
constexpr double kPartDof = 3.0;  ///< degrees of freedom of each
[[nodiscard]] std::string_view part_name(StatePart part);

/// The drive and the times of evaluation: seconds since the first sensor message.
struct ConsistencyPlan {
  double outage_begin_s = 35.0;                    ///< GPS is cut from here to the end
  std::vector<double> times_s = {30, 45, 65, 95};  ///< ascending

  /// The drill of this plan, without limits.
  [[nodiscard]] drills::Drill drill(const std::string& scenario, const std::string& ins) const;
  /// Time since the begin of the outage; nullopt: before it.
  [[nodiscard]] std::optional<double> into_outage_s(double t_s) const;
};

/// Error of one part at one moment.
struct PartError {
  double error = 0.0;      ///< magnitude [m, m/s, rad]
  double predicted = 0.0;  ///< root of the trace of the covariance, in the same unit
  double nees = 0.0;       ///< expected 3
};
/// nullopt: no belief, no truth, or an invalid covariance.
using PartErrors = std::array<std::optional<PartError>, kStateParts.size()>;

/// @param v_truth_world  [m/s]; nullopt: velocity unknown
[[nodiscard]] PartErrors part_errors(const drills::DrillBelief& belief,
                                     const Pose& T_world_vehicle_truth,
                                     const std::optional<Vec3>& v_truth_world);

/// Sums over the measurements of one source with a NIS (has_nis()).
struct InnovationSums {
  std::size_t count = 0;
  std::size_t refused = 0;  ///< of these, rejected by the gate
  double nis_per_dof = 0.0;
  double lagged = 0.0;  ///< sum of z_i z_j over components and successive measurements i, j
  double square = 0.0;  ///< sum of (z_i^2 + z_j^2) / 2 over the same

  void add(const InnovationSums& more);
  /// 1 for a consistent filter.
  [[nodiscard]] double mean_nis_per_dof() const;
  /// Correlation of successive normalized innovations, in [-1, 1]; 0 if they are white. nullopt: no
  /// two successive ones.
  [[nodiscard]] std::optional<double> lag1() const;
};
/// By name of the source in innovation_t.
using Innovations = std::map<std::string, InnovationSums>;

/// Successive: of one source and size, both with a NIS, at most 2 s apart.
[[nodiscard]] Innovations innovation_sums(const std::vector<drills::DrillInnovation>& innovations);

/// Results of one run.
struct ConsistencyRun {
  std::int64_t seed = 0;
  std::vector<PartErrors> at;     ///< at the times of the plan
  std::vector<PartErrors> curve;  ///< at 0, 1, 2 ... s, up to the last time of the plan
  Innovations innovations;
  std::optional<drills::IntegrityMetrics> integrity;  ///< of the outage; nullopt: not published
};
[[nodiscard]] ConsistencyRun consistency_run(const ConsistencyPlan& plan, std::int64_t seed,
                                             const drills::DrillRecord& record);

/// Runs of one scenario and one INS grade.
struct ConsistencyBlock {
  std::string scenario;  ///< path
  std::string ins;       ///< grade
  std::vector<ConsistencyRun> runs;
  std::string error;  ///< reason of a failure; empty: none

  [[nodiscard]] bool was_run() const { return error.empty() && !runs.empty(); }
};

struct ValueInterval {
  double low = 0.0;
  double high = 0.0;

  [[nodiscard]] bool contains(double v) const { return v >= low && v <= high; }
};
constexpr ValueInterval kNeesLimit = {0.5, 1.5};  ///< mean NEES per degree of freedom
constexpr ValueInterval kInsideLimit = {0.88,
                                        0.99};   ///< share of true states in the 95 % ellipsoid
constexpr ValueInterval kNisLimit = {0.4, 1.3};  ///< mean NIS per degree of freedom, before gating

/// `z`-sigma interval of the mean NEES per degree of freedom of a consistent filter, for `dof`
/// degrees in total (Wilson and Hilferty 1931).
/// @param dof  > 0
[[nodiscard]] ValueInterval chance_of_mean(double dof, double z);

/// One part over the runs of a block.
struct PartMetrics {
  std::size_t count = 0;
  std::size_t missing = 0;  ///< runs without a value
  double nees_per_dof = 0.0;
  double inside = 0.0;  ///< share inside the 95 % ellipsoid
  double rms_error = 0.0;
  double rms_predicted = 0.0;
};
[[nodiscard]] PartMetrics metrics_at(const ConsistencyBlock& block, std::size_t time,
                                     StatePart part);
[[nodiscard]] PartMetrics metrics_at_second(const ConsistencyBlock& block, std::size_t second,
                                            StatePart part);
/// Over all times of the plan.
[[nodiscard]] PartMetrics metrics_of_all(const ConsistencyBlock& block, StatePart part);
[[nodiscard]] Innovations pooled_innovations(const ConsistencyBlock& block);

/// Over the outages of the runs.
struct ProtectionMetrics {
  std::size_t samples = 0;
  double within_horizontal = 0.0;  ///< share of the time with the error within the level
  double within_vertical = 0.0;
  int missed_alerts = 0;
  double false_alerts_per_h = 0.0;  ///< with GPS
};
[[nodiscard]] ProtectionMetrics protection(const ConsistencyBlock& block);

/// A value outside its limit fails; with fewer than 20 runs (for a NIS: 100 measurements) only if
/// the violation is significant for a consistent filter, else the verdict is inconclusive.
[[nodiscard]] drills::Verdict nees_verdict(const PartMetrics& f);
[[nodiscard]] drills::Verdict inside_verdict(const PartMetrics& f, std::size_t runs);
[[nodiscard]] drills::Verdict nis_verdict(const InnovationSums& sums);

/// kFail if any limit or any run failed.
[[nodiscard]] drills::Verdict verdict_of(const ConsistencyPlan& plan,
                                         const ConsistencyBlock& block);

}  // namespace rcs::studies

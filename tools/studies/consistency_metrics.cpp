#include "tools/studies/consistency_metrics.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "tools/drills/drill_metrics.h"
#include "tools/evaluation/trajectory_error.h"

#include "lcmtypes/message_names.h"

namespace rcs::studies {
namespace {

/// 95 % quantile of the chi-square distribution with 3 degrees of freedom.
constexpr double k95Percent = 7.8147;
constexpr Duration kLongestPair = std::chrono::seconds(2);
constexpr std::size_t kRunsToTell = 20;
constexpr std::size_t kMeasurementsToTell = 100;
/// One-sided 1/1000 quantile of the normal distribution.
constexpr double kChance_sigma = 3.09;

std::optional<PartError> part_error(const Vec3& e, const Mat3& P) {
  const Eigen::LLT<Mat3> llt(P);
  if (llt.info() != Eigen::Success || !e.allFinite()) return std::nullopt;
  return PartError{e.norm(), std::sqrt(P.trace()), e.dot(llt.solve(e))};
}

/// Interpolates the samples around the moment. nullopt outside, or if velocities are unknown.
std::optional<Vec3> truth_velocity(const drills::DrillRecord& record, Stamp stamp) {
  const tools::Trajectory& truth = record.truth;
  if (record.v_truth_world.size() != truth.size()) return std::nullopt;
  const auto after =
      std::lower_bound(truth.begin(), truth.end(), stamp,
                       [](const tools::StampedPose& s, Stamp t) { return s.stamp < t; });
  if (after == truth.end()) return std::nullopt;
  const auto j = static_cast<std::size_t>(after - truth.begin());
  if (after->stamp == stamp) return record.v_truth_world[j];
  if (j == 0) return std::nullopt;
  const double u = seconds(stamp - truth[j - 1].stamp) / seconds(after->stamp - truth[j - 1].stamp);
  return Vec3((1.0 - u) * record.v_truth_world[j - 1] + u * record.v_truth_world[j]);
}

PartErrors errors_at(const drills::DrillRecord& record, const drills::DrillErrors& errors,
                     double t_s) {
  const drills::DrillBelief* belief = errors.belief_at(errors.stamp_at(t_s));
  if (belief == nullptr) return {};
  const std::optional<Pose> truth = errors.truth_at(belief->stamp);
  if (!truth) return {};
  return part_errors(*belief, *truth, truth_velocity(record, belief->stamp));
}

/// Sums of a metric.
class MetricSums {
 public:
  void add(const std::optional<PartError>& e) {
    if (!e) {
      ++f_.missing;
      return;
    }
    ++f_.count;
    f_.nees_per_dof += e->nees / kPartDof;
    f_.inside += e->nees <= k95Percent ? 1.0 : 0.0;
    f_.rms_error += e->error * e->error;
    f_.rms_predicted += e->predicted * e->predicted;
  }
  [[nodiscard]] PartMetrics metric() const {
    PartMetrics f = f_;
    if (f.count == 0) return f;
    const double n = static_cast<double>(f.count);
    f.nees_per_dof /= n;
    f.inside /= n;
    f.rms_error = std::sqrt(f.rms_error / n);
    f.rms_predicted = std::sqrt(f.rms_predicted / n);
    return f;
  }

 private:
  PartMetrics f_;
};

std::size_t index(StatePart part) { return static_cast<std::size_t>(part); }

/// @param chance  interval of the value for a consistent filter
drills::Verdict judge(double value, const ValueInterval& limits, const ValueInterval& chance,
                      bool enough) {
  if (limits.contains(value)) return drills::Verdict::kPass;
  return enough || !chance.contains(value) ? drills::Verdict::kFail
                                           : drills::Verdict::kInconclusive;
}

}  // namespace

std::string_view part_name(StatePart part) {
  static constexpr std::array<std::string_view, kStateParts.size()> kNames = {
      "position", "velocity", "attitude"};
  return kNames[index(part)];
}

drills::Drill ConsistencyPlan::drill(const std::string& scenario, const std::string& ins) const {
  drills::Drill drill;
  drill.id = std::filesystem::path(scenario).stem().string() + ", " + ins;
  drill.name = drill.id;
  drill.needs_simulator = true;
  drill.run.scenario = scenario;
  drill.run.ins = ins;
  drill.run.length_s = times_s.back() + 1.0;
  const double length_s = std::max(1.0, drill.run.length_s - outage_begin_s);
  drill.stimuli = {drills::dropout(drills::DrillSource::kGps, outage_begin_s, length_s)};
  return drill;
}

std::optional<double> ConsistencyPlan::into_outage_s(double t_s) const {
  return t_s < outage_begin_s ? std::nullopt : std::optional(t_s - outage_begin_s);
}

PartErrors part_errors(const drills::DrillBelief& belief, const Pose& T_world_vehicle_truth,
                       const std::optional<Vec3>& v_truth_world) {
  const Vec6 xi = evaluation::pose_error(belief.T_world_vehicle, T_world_vehicle_truth);
  PartErrors e;
  e[index(StatePart::kPosition)] =
      part_error(xi.head<3>(), belief.cov_world_pose.topLeftCorner<3, 3>());
  e[index(StatePart::kAttitude)] =
      part_error(xi.tail<3>(), belief.cov_world_pose.bottomRightCorner<3, 3>());
  if (v_truth_world) {
    e[index(StatePart::kVelocity)] =
        part_error(*v_truth_world - belief.v_world, belief.cov_v_world);
  }
  return e;
}

void InnovationSums::add(const InnovationSums& more) {
  count += more.count;
  refused += more.refused;
  nis_per_dof += more.nis_per_dof;
  lagged += more.lagged;
  square += more.square;
}

double InnovationSums::mean_nis_per_dof() const {
  return count == 0 ? 0.0 : nis_per_dof / static_cast<double>(count);
}

std::optional<double> InnovationSums::lag1() const {
  return square > 0.0 ? std::optional(lagged / square) : std::nullopt;
}

Innovations innovation_sums(const std::vector<drills::DrillInnovation>& innovations) {
  Innovations by_source;
  std::map<std::string, const drills::DrillInnovation*> last;
  for (const drills::DrillInnovation& i : innovations) {
    if (!drills::has_nis(i)) continue;
    const std::string source(innovation_source_name(i.source));
    InnovationSums& sums = by_source[source];
    ++sums.count;
    sums.refused += i.accepted ? 0 : 1;
    sums.nis_per_dof += i.nis / i.dof;
    const drills::DrillInnovation*& before = last[source];
    const bool successive = before != nullptr && before->dof == i.dof && before->stamp < i.stamp &&
                            i.stamp - before->stamp <= kLongestPair;
    if (successive) {
      sums.lagged += before->normalized.dot(i.normalized);
      sums.square += 0.5 * (before->normalized.squaredNorm() + i.normalized.squaredNorm());
    }
    before = &i;
  }
  return by_source;
}

ConsistencyRun consistency_run(const ConsistencyPlan& plan, std::int64_t seed,
                               const drills::DrillRecord& record) {
  const drills::DrillErrors errors(record);
  ConsistencyRun run;
  run.seed = seed;
  for (const double t_s : plan.times_s) run.at.push_back(errors_at(record, errors, t_s));
  for (double t_s = 0.0; t_s <= plan.times_s.back(); t_s += 1.0) {
    run.curve.push_back(errors_at(record, errors, t_s));
  }
  run.innovations = innovation_sums(record.innovations);
  run.integrity = drills::integrity_metrics(plan.drill("", ""), record, errors);
  return run;
}

ValueInterval chance_of_mean(double dof, double z) {
  const double a = 2.0 / (9.0 * dof);
  const auto at = [a](double sigmas) { return std::pow(1.0 - a + sigmas * std::sqrt(a), 3.0); };
  return {std::max(0.0, at(-z)), at(z)};
}

PartMetrics metrics_at(const ConsistencyBlock& block, std::size_t time, StatePart part) {
  MetricSums sums;
  for (const ConsistencyRun& run : block.runs) sums.add(run.at[time][index(part)]);
  return sums.metric();
}

PartMetrics metrics_at_second(const ConsistencyBlock& block, std::size_t second, StatePart part) {
  MetricSums sums;
  for (const ConsistencyRun& run : block.runs) sums.add(run.curve[second][index(part)]);
  return sums.metric();
}

PartMetrics metrics_of_all(const ConsistencyBlock& block, StatePart part) {
  MetricSums sums;
  for (const ConsistencyRun& run : block.runs) {
    for (const PartErrors& moment : run.at) sums.add(moment[index(part)]);
  }
  return sums.metric();
}

Innovations pooled_innovations(const ConsistencyBlock& block) {
  Innovations pooled;
  for (const ConsistencyRun& run : block.runs) {
    for (const auto& [source, sums] : run.innovations) pooled[source].add(sums);
  }
  return pooled;
}

ProtectionMetrics protection(const ConsistencyBlock& block) {
  ProtectionMetrics f;
  for (const ConsistencyRun& run : block.runs) {
    if (!run.integrity) continue;
    const double n = static_cast<double>(run.integrity->samples);
    f.samples += run.integrity->samples;
    f.within_horizontal += n * run.integrity->within_horizontal;
    f.within_vertical += n * run.integrity->within_vertical;
    f.missed_alerts += run.integrity->missed_alerts;
    f.false_alerts_per_h += n * run.integrity->false_alerts_per_h;
  }
  if (f.samples == 0) return f;
  const double n = static_cast<double>(f.samples);
  f.within_horizontal /= n;
  f.within_vertical /= n;
  f.false_alerts_per_h /= n;
  return f;
}

drills::Verdict nees_verdict(const PartMetrics& f) {
  if (f.missing > 0 || f.count == 0) return drills::Verdict::kFail;
  const ValueInterval chance =
      chance_of_mean(kPartDof * static_cast<double>(f.count), kChance_sigma);
  return judge(f.nees_per_dof, kNeesLimit,
               {kNeesLimit.low * chance.low, kNeesLimit.high * chance.high},
               f.count >= kRunsToTell);
}

drills::Verdict inside_verdict(const PartMetrics& f, std::size_t runs) {
  if (f.missing > 0 || f.count == 0) return drills::Verdict::kFail;
  // The moments of a run are correlated: a run counts once.
  const double p = kInsideLimit.low;
  const double spread = kChance_sigma * std::sqrt(p * (1.0 - p) / static_cast<double>(runs));
  return judge(f.inside, kInsideLimit, {p - spread, 1.0}, runs >= kRunsToTell);
}

drills::Verdict nis_verdict(const InnovationSums& sums) {
  const bool enough = sums.count >= kMeasurementsToTell;
  const double value = sums.mean_nis_per_dof();
  return judge(value, kNisLimit, {value, value}, enough);
}

drills::Verdict verdict_of(const ConsistencyPlan& plan, const ConsistencyBlock& block) {
  if (!block.was_run()) return drills::Verdict::kFail;
  bool open = false;
  bool fails = false;
  const auto count = [&](drills::Verdict v) {
    fails = fails || v == drills::Verdict::kFail;
    open = open || v == drills::Verdict::kInconclusive;
  };
  for (const StatePart part : kStateParts) {
    for (std::size_t k = 0; k < plan.times_s.size(); ++k) {
      count(nees_verdict(metrics_at(block, k, part)));
    }
    count(inside_verdict(metrics_of_all(block, part), block.runs.size()));
  }
  for (const auto& [source, sums] : pooled_innovations(block)) count(nis_verdict(sums));
  return fails  ? drills::Verdict::kFail
         : open ? drills::Verdict::kInconclusive
                : drills::Verdict::kPass;
}

}  // namespace rcs::studies

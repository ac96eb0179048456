#include "tools/drills/drill_metrics.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "lcmtypes/message_names.h"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "tools/base/statistics.h"
#include "tools/evaluation/trajectory_error.h"

namespace rcs::drills {
namespace {

constexpr Duration kMaxTruthGap = std::chrono::milliseconds(500);
constexpr Duration kMaxBeliefAge = std::chrono::milliseconds(500);
constexpr double kSample_s = 0.1;
constexpr double kAtRest_m = 10.0;

}  // namespace

DrillErrors::DrillErrors(const DrillRecord& record) : record_(record) {
  by_stamp_.reserve(record.beliefs.size());
  for (const DrillBelief& b : record.beliefs) by_stamp_.push_back(&b);
  std::stable_sort(by_stamp_.begin(), by_stamp_.end(),
                   [](const DrillBelief* a, const DrillBelief* b) { return a->stamp < b->stamp; });
}

double DrillErrors::time_s(Stamp stamp) const {
  return seconds(stamp - record_.begin.value_or(Stamp()));
}

Stamp DrillErrors::stamp_at(double t_s) const {
  return record_.begin.value_or(Stamp()) + from_seconds(t_s);
}

std::optional<Pose> DrillErrors::truth_at(Stamp stamp) const {
  return tools::pose_at(record_.truth, stamp, kMaxTruthGap);
}

const DrillBelief* DrillErrors::belief_at(Stamp stamp) const {
  const auto after = std::upper_bound(by_stamp_.begin(), by_stamp_.end(), stamp,
                                      [](Stamp t, const DrillBelief* b) { return t < b->stamp; });
  if (after == by_stamp_.begin()) return nullptr;
  const DrillBelief* b = *(after - 1);
  return stamp - b->stamp <= kMaxBeliefAge ? b : nullptr;
}

std::optional<DrillError> DrillErrors::of(const DrillBelief& b) const {
  const std::optional<Pose> truth = truth_at(b.stamp);
  if (!truth) return std::nullopt;
  DrillError e;
  e.t_s = time_s(b.stamp);
  e.position_m = b.T_world_vehicle.p - truth->p;
  const double heading = yaw_of(truth->q);
  e.along_m = std::cos(heading) * e.position_m.x() + std::sin(heading) * e.position_m.y();
  e.across_m = -std::sin(heading) * e.position_m.x() + std::cos(heading) * e.position_m.y();
  e.heading_rad = wrap_angle(yaw_of(b.T_world_vehicle.q) - heading);
  const Mat3 R = b.T_world_vehicle.rotation();
  const Mat3 P = R * b.cov_world_pose.topLeftCorner<3, 3>() * R.transpose();
  const Mat<2> P_horizontal = P.topLeftCorner<2, 2>();
  const Eigen::SelfAdjointEigenSolver<Mat<2>> eigen(P_horizontal, Eigen::EigenvaluesOnly);
  e.sigma_horizontal_m = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
  e.nees = evaluation::nees(evaluation::pose_error(b.T_world_vehicle, *truth), b.cov_world_pose);
  return e;
}

std::optional<DrillError> DrillErrors::at(Stamp stamp) const {
  const DrillBelief* b = belief_at(stamp);
  return b == nullptr ? std::nullopt : of(*b);
}

double DrillErrors::driven_m(Stamp from, Stamp to) const {
  double driven_m = 0.0;
  std::optional<Pose> last;
  for (Stamp t = from; t <= to; t += from_seconds(kSample_s)) {
    const std::optional<Pose> here = truth_at(t);
    if (here && last) driven_m += (here->p - last->p).norm();
    if (here) last = here;
  }
  return driven_m;
}

std::vector<DrillError> DrillErrors::sampled() const {
  std::vector<DrillError> out;
  Stamp due = Stamp::min();
  for (const DrillBelief* b : by_stamp_) {
    if (b->stamp < due) continue;
    if (const std::optional<DrillError> e = of(*b)) out.push_back(*e);
    due = b->stamp + from_seconds(kSample_s);
  }
  return out;
}

std::vector<DrillWindow> gps_outages_of(const Drill& drill) {
  std::vector<DrillWindow> outages;
  for (const Stimulus& s : drill.stimuli) {
    if (!(s.source == DrillSource::kGps || s.source == DrillSource::kAll)) continue;
    if (s.kind == StimulusKind::kDropout) outages.push_back({s.begin_s, s.end_s()});
    for (int k = 0; s.kind == StimulusKind::kFlapping && k < s.count; ++k) {
      const double begin_s = s.begin_s + k * (s.on_s + s.off_s) + s.on_s;
      outages.push_back({begin_s, begin_s + s.off_s});
    }
  }
  return outages;
}

std::vector<OutageDrift> outage_drifts(const Drill& drill, const DrillRecord& record,
                                       const DrillErrors& errors) {
  std::vector<OutageDrift> drifts;
  for (DrillWindow window : gps_outages_of(drill)) {
    window.end_s = std::min(window.end_s, errors.time_s(record.end));
    const Stamp from = errors.stamp_at(window.begin_s);
    const Stamp to = errors.stamp_at(window.end_s);
    const std::optional<DrillError> start = errors.at(from);
    const std::optional<DrillError> end = errors.at(to);
    if (!end || window.end_s <= window.begin_s) continue;
    OutageDrift d;
    d.window = window;
    d.driven_m = errors.driven_m(from, to);
    if (start) d.start_m = start->horizontal_m();
    if (start) d.heading_start_rad = std::abs(start->heading_rad);
    d.end_m = end->horizontal_m();
    if (d.driven_m >= kAtRest_m) d.drift_pct = 100.0 * d.end_m / d.driven_m;
    d.m_per_min = d.end_m * 60.0 / window.length_s();
    drifts.push_back(d);
  }
  return drifts;
}

AccuracyMetrics accuracy(const Drill& drill, const DrillErrors& errors) {
  AccuracyMetrics f;
  std::vector<double> horizontal_m;
  std::vector<double> vertical_m;
  std::vector<double> along_m;
  std::vector<double> across_m;
  std::size_t with_nees = 0;
  for (const DrillError& e : errors.sampled()) {
    if (e.t_s < drill.begin_s()) continue;
    horizontal_m.push_back(e.horizontal_m());
    vertical_m.push_back(e.vertical_m());
    along_m.push_back(e.along_m);
    across_m.push_back(e.across_m);
    if (!e.nees) continue;
    f.nees_per_dof += *e.nees / 6.0;
    ++with_nees;
  }
  if (with_nees > 0) f.nees_per_dof /= static_cast<double>(with_nees);
  f.samples = horizontal_m.size();
  const tools::Summary horizontal = tools::summarize(std::move(horizontal_m));
  f.cep50_m = horizontal.p50;
  f.cep95_m = horizontal.p95;
  f.horizontal_max_m = horizontal.max;
  f.vertical95_m = tools::summarize(std::move(vertical_m)).p95;
  f.along_rms_m = tools::summarize(std::move(along_m)).rms;
  f.across_rms_m = tools::summarize(std::move(across_m)).rms;
  return f;
}

SmoothStep largest_smooth_step(const Drill& drill, const DrillRecord& record) {
  constexpr double kLongest_s = 0.5;
  SmoothStep worst;
  const DrillBelief* last = nullptr;
  for (const DrillBelief& b : record.beliefs) {
    const DrillBelief* before = std::exchange(last, &b);
    const double t_s = seconds(b.stamp - record.begin.value_or(Stamp()));
    if (before == nullptr || t_s < drill.begin_s()) continue;
    const double dt_s = seconds(b.stamp - before->stamp);
    if (dt_s < 0.0 || dt_s > kLongest_s) continue;
    const Vec3 predicted = before->T_local_vehicle.p + dt_s * before->v_local +
                           0.5 * dt_s * dt_s * before->accel_local;
    const double step_m = (b.T_local_vehicle.p - predicted).norm();
    if (step_m > worst.m) worst = {step_m, t_s};
  }
  return worst;
}

std::map<std::string, NisMetric> nis_metrics(const DrillRecord& record) {
  std::map<std::string, NisMetric> metrics;
  for (const DrillInnovation& i : record.innovations) {
    NisMetric& f = metrics[std::string(innovation_source_name(i.source))];
    ++f.considered;
    if (i.accepted) ++f.accepted;
    if (!has_nis(i)) continue;
    ++f.gated;
    f.per_dof += i.nis / i.dof;
  }
  for (auto& [name, f] : metrics) {
    if (f.gated > 0) f.per_dof /= static_cast<double>(f.gated);
  }
  return metrics;
}

bool has_nis(const DrillInnovation& i) {
  return (i.accepted || i.reason == innovation_t::REASON_GATE) && i.dof > 0;
}

}  // namespace rcs::drills

#include "tools/studies/outages.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "tools/drills/drill_metrics.h"
#include "tools/evaluation/trajectory_error.h"

namespace rcs::studies {
namespace {

/// Time after the first correct fix within which GPS must be accepted to count as recovered.
constexpr double kBack_s = 5.0;
constexpr Duration kMaxMatchGap = std::chrono::milliseconds(500);
constexpr PoseEstimator kCarriedOn[] = {PoseEstimator::kGyroAndWheels,
                                        PoseEstimator::kGyroAndLastSpeed, PoseEstimator::kWheels,
                                        PoseEstimator::kInertial, PoseEstimator::kLadar};
constexpr std::array<std::string_view, kPoseEstimators> kEstimatorNames = {
    "WM",           "WM with GPS", "gyro and wheels", "gyro, speed held",
    "wheels alone", "INS alone",   "LADAR alone"};

OutageError error_of(const Pose& estimate, const Pose& reference) {
  const Vec3 off_m = estimate.p - reference.p;
  return {off_m.head<2>().norm(), std::abs(off_m.z()),
          wrap_angle(yaw_of(estimate.q) - yaw_of(reference.q))};
}

ReckoningStart start_at(const drills::DrillBelief& b) {
  return {b.stamp,           b.T_world_vehicle, b.v_world,
          b.gyro_bias_radps, b.accel_bias_mps2, b.wheel_scale};
}

/// T_from_to along the rolling map of SP; nullopt if the map was restarted in between.
std::optional<Pose> along_map(const std::vector<drills::DrillMatch>& matches, Stamp from,
                              Stamp to) {
  std::map<std::int32_t, tools::Trajectory> epochs;
  for (const drills::DrillMatch& m : matches) {
    tools::Trajectory& poses = epochs[m.epoch];
    const bool ascends = poses.empty() || m.stamp > poses.back().stamp;
    if (ascends) poses.push_back({m.stamp, m.T_rolling_vehicle});
  }
  for (const auto& [epoch, poses] : epochs) {
    const std::optional<Pose> a = tools::pose_at(poses, from, kMaxMatchGap);
    const std::optional<Pose> b = tools::pose_at(poses, to, kMaxMatchGap);
    if (a && b) return a->inverse() * *b;
  }
  return std::nullopt;
}

const drills::DrillBelief* last_of(const drills::DrillRecord& record) {
  const auto last = std::max_element(
      record.beliefs.begin(), record.beliefs.end(),
      [](const drills::DrillBelief& a, const drills::DrillBelief& b) { return a.stamp < b.stamp; });
  return last == record.beliefs.end() ? nullptr : &*last;
}

/// Input of all estimators.
struct Evidence {
  const OutageQuestion& question;
  const RecordedMotion& motion;
  const std::vector<OutagePlan>& plans;
  const std::vector<drills::DrillResult>& results;

  [[nodiscard]] const drills::DrillRecord* record(OutagePlan::Kind kind,
                                                  std::size_t variant) const {
    for (std::size_t i = 0; i < plans.size(); ++i) {
      if (plans[i].kind == kind && plans[i].variant == variant && results[i].shown) {
        return &*results[i].shown;
      }
    }
    return nullptr;
  }
};

/// T_world_vehicle at `to` by the estimators other than WM and the run with GPS.
std::optional<Pose> carried_on(const Evidence& e, PoseEstimator estimator, std::size_t variant,
                               const drills::DrillBelief& start, Stamp to) {
  const bool wheels = e.question.uses(variant, drills::DrillSource::kOdometry);
  const bool ins = e.question.uses(variant, drills::DrillSource::kIns);
  switch (estimator) {
    case PoseEstimator::kGyroAndWheels:
      if (!wheels || !ins) return std::nullopt;
      return reckon(ReckonedBy::kGyroAndWheels, start_at(start), e.motion, to);
    case PoseEstimator::kGyroAndLastSpeed:
      if (!ins) return std::nullopt;
      return reckon(ReckonedBy::kGyroAndLastSpeed, start_at(start), e.motion, to);
    case PoseEstimator::kWheels:
      if (!wheels) return std::nullopt;
      return reckon(ReckonedBy::kWheels, start_at(start), e.motion, to);
    case PoseEstimator::kInertial:
      if (!ins) return std::nullopt;
      return reckon(ReckonedBy::kInertial, start_at(start), e.motion, to);
    case PoseEstimator::kLadar: {
      const drills::DrillRecord* record = e.record(OutagePlan::Kind::kNoGps, 0);
      if (record == nullptr || !e.question.uses(variant, drills::DrillSource::kLadar)) {
        return std::nullopt;
      }
      const std::optional<Pose> way = along_map(record->matches, start.stamp, to);
      return way ? std::optional<Pose>(start.T_world_vehicle * *way) : std::nullopt;
    }
    default:
      return std::nullopt;
  }
}

void compare_with_fix(const drills::DrillRecord& record, const drills::DrillErrors& errors,
                      Stamp end, OutageFinding* f) {
  const auto fix = std::find_if(
      record.fixes.begin(), record.fixes.end(),
      [&](const drills::DrillFix& x) { return x.arrival >= end && x.p_world.allFinite(); });
  if (fix == record.fixes.end()) return;
  const drills::DrillBelief* b = errors.belief_at(fix->stamp);
  if (b == nullptr) return;
  // Beliefs are published at 50 Hz: at 20 m/s one is up to 0.4 m behind the fix.
  const Vec3 antenna =
      b->T_world_vehicle * record.p_vehicle_antenna + seconds(fix->stamp - b->stamp) * b->v_world;
  f->to_fix_m = (antenna - fix->p_world).head<2>().norm();
  f->fix_sigma_m = fix->sigma_m.head<2>().maxCoeff();
}

OutageFinding judge(const Evidence& e, const OutagePlan& plan, const drills::DrillResult& result) {
  OutageFinding f;
  f.variant = plan.variant;
  f.window = plan.window;
  f.failed = result.error;
  if (!result.shown) return f;
  const drills::DrillRecord& record = *result.shown;
  const drills::DrillErrors errors(record);
  const Stamp begin = errors.stamp_at(plan.window.begin_s);
  const Stamp end = errors.stamp_at(plan.window.end_s);
  f.driven_m = errors.driven_m(begin, end);
  const drills::DrillBelief* before = errors.belief_at(begin);
  const drills::DrillBelief* after = errors.belief_at(end);
  const std::optional<Pose> truth = after == nullptr ? std::nullopt : errors.truth_at(after->stamp);
  if (before == nullptr) {
    f.failed = "WM had no world pose at the begin of the outage";
  } else if (after == nullptr) {
    f.failed = "WM had no world pose at the end of the outage";
  } else if (!truth) {
    f.failed = "no reference at the end of the outage";
  }
  if (!f.failed.empty()) return f;

  const auto at_end = [&f](PoseEstimator t) -> std::optional<OutageError>& {
    return f.at_end[static_cast<std::size_t>(t)];
  };
  if (const std::optional<Pose> there = errors.truth_at(before->stamp)) {
    f.at_begin = error_of(before->T_world_vehicle, *there);
  }
  at_end(PoseEstimator::kWm) = error_of(after->T_world_vehicle, *truth);
  f.sigma_m = errors.of(*after)->sigma_horizontal_m;
  const bool is_reference = plan.variant == 0 && !e.motion.has_truth;
  const drills::DrillRecord* with_gps = e.record(OutagePlan::Kind::kWmWithGps, plan.variant);
  if (with_gps != nullptr && !is_reference) {
    const std::optional<drills::DrillError> same = drills::DrillErrors(*with_gps).at(after->stamp);
    if (same) {
      at_end(PoseEstimator::kWmWithGps) =
          OutageError{same->horizontal_m(), same->vertical_m(), same->heading_rad};
    }
  }
  for (const PoseEstimator t : kCarriedOn) {
    const std::optional<Pose> T = carried_on(e, t, plan.variant, *before, after->stamp);
    if (T) at_end(t) = error_of(*T, *truth);
  }
  compare_with_fix(record, errors, end, &f);
  if (!result.runs.empty() && !result.runs.front().returns.empty()) {
    const drills::GpsReturn& back = result.runs.front().returns.front();
    f.back_after_s = back.accepted_after_s;
    f.may_be_back = back.accepted_after_s || errors.time_s(record.end) - back.clean_s >= kBack_s;
  }
  const drills::DrillBelief* last = last_of(record);
  if (const std::optional<Pose> there = errors.truth_at(last->stamp); e.question.cut && there) {
    f.at_log_end = error_of(last->T_world_vehicle, *there);
  }
  return f;
}

/// Start at the begin of the log without initialization: a distance does not depend on the heading.
drills::DrillBelief nothing_known(const RecordedMotion& motion) {
  drills::DrillBelief b;
  b.stamp = motion.begin.value_or(Stamp());
  return b;
}

ClosureFinding closure(const Evidence& e, std::size_t variant, const drills::DrillRecord& cut) {
  ClosureFinding c;
  c.variant = variant;
  const auto good = [](const drills::DrillFix& f) { return f.p_world.allFinite(); };
  const auto first_fix = std::find_if(cut.fixes.begin(), cut.fixes.end(), good);
  const auto last_fix = std::find_if(cut.fixes.rbegin(), cut.fixes.rend(), good);
  if (first_fix == cut.fixes.end()) return c;
  const auto from_first_fix = [&](const Vec3& p_world) {
    return (p_world - first_fix->p_world).head<2>().norm();
  };
  c.fixes_m = from_first_fix(last_fix->p_world);
  const auto of = [&](const drills::DrillRecord* record) -> std::optional<double> {
    if (record == nullptr || record->beliefs.empty()) return std::nullopt;
    return from_first_fix(last_of(*record)->T_world_vehicle * record->p_vehicle_antenna);
  };
  c.m[static_cast<std::size_t>(PoseEstimator::kWm)] = of(&cut);
  c.m[static_cast<std::size_t>(PoseEstimator::kWmWithGps)] =
      of(e.record(OutagePlan::Kind::kWmWithGps, variant));
  // The other estimators require an initial speed or a map.
  for (const PoseEstimator t : {PoseEstimator::kGyroAndWheels, PoseEstimator::kWheels}) {
    const std::optional<Pose> T =
        carried_on(e, t, variant, nothing_known(e.motion), last_fix->stamp);
    if (T) c.m[static_cast<std::size_t>(t)] = T->p.head<2>().norm();
  }
  return c;
}

WithGpsFinding judge_with_gps(const Evidence& e) {
  WithGpsFinding u;
  const drills::DrillRecord* record = e.record(OutagePlan::Kind::kWmWithGps, 0);
  if (record == nullptr) return u;
  const drills::DrillErrors errors(*record);
  std::size_t seen = 0;
  std::size_t trusted = 0;
  for (const drills::DrillIntegrity& i : record->integrity) {
    if (errors.time_s(i.stamp) < e.question.from_s) continue;
    ++seen;
    const bool accepted =
        i.gps == integrity_t::STATUS_ACCEPTED || i.gps == integrity_t::STATUS_SUSPECT;
    trusted += accepted ? 1 : 0;
  }
  if (seen > 0) u.accepted_share = static_cast<double>(trusted) / static_cast<double>(seen);
  for (const drills::DrillEvent& event : record->events) {
    if (event.severity >= event_t::SEVERITY_WARNING) u.warnings.push_back(event);
  }
  return u;
}

std::string variant_name(const std::vector<drills::DrillSource>& without) {
  std::string name = "without ";
  for (const drills::DrillSource& s : without) {
    name += (&s == &without.front() ? "" : " and ") + std::string(drills::source_name(s));
  }
  return name;
}

}  // namespace

std::string_view estimator_name(PoseEstimator estimator) {
  return kEstimatorNames[static_cast<std::size_t>(estimator)];
}

OutageReport judge_outages(const OutageQuestion& question, const std::vector<OutagePlan>& plans,
                           const std::vector<drills::DrillResult>& results,
                           const RecordedMotion& motion) {
  const Evidence evidence{question, motion, plans, results};
  OutageReport report;
  report.reference =
      motion.has_truth ? "SIM_TRUTH of the log" : "belief of WM with GPS in the whole run";
  report.variants.emplace_back("all sources");
  for (const auto& without : question.without) report.variants.push_back(variant_name(without));
  for (std::size_t i = 0; i < plans.size(); ++i) {
    if (plans[i].kind != OutagePlan::Kind::kOutage) continue;
    report.findings.push_back(judge(evidence, plans[i], results[i]));
    if (question.cut && results[i].shown) {
      report.closures.push_back(closure(evidence, plans[i].variant, *results[i].shown));
    }
  }
  report.with_gps = judge_with_gps(evidence);
  return report;
}

}  // namespace rcs::studies

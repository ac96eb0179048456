#include "tools/drills/drill_fault_detection.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"

namespace rcs::drills {
namespace {

constexpr double kFalseSigmas = 6.0;
constexpr double kCleanSigmas = 4.0;
constexpr double kMissedAfter_s = 2.0;
// Times after a fault and after the start in which alerts do not count as false.
constexpr double kSettle_s = 20.0;

std::optional<Vec3> fix_error(const DrillRecord& record, const DrillErrors& errors,
                              const DrillFix& fix) {
  const std::optional<Pose> truth = errors.truth_at(fix.stamp);
  if (!truth) return std::nullopt;
  return Vec3(fix.p_world - *truth * record.p_vehicle_antenna);
}

double sigmas_of(const Vec3& error_m, const Mat3& covariance) {
  return std::sqrt(std::max(0.0, error_m.dot(covariance.ldlt().solve(error_m))));
}

bool is_clean(const DrillRecord& record, const DrillErrors& errors, const DrillFix& fix) {
  const std::optional<Vec3> e = fix_error(record, errors, fix);
  if (!e || !e->allFinite() || !fix.sigma_m.allFinite()) return false;
  const Vec3 variance = fix.sigma_m.cwiseProduct(fix.sigma_m).cwiseMax(1e-6);
  return sigmas_of(*e, variance.asDiagonal()) <= kCleanSigmas;
}

/// The fix of an innovation: the newest with its stamp that had arrived.
const DrillFix* fix_of(const DrillRecord& record, const DrillInnovation& i) {
  const DrillFix* found = nullptr;
  for (const DrillFix& f : record.fixes) {
    if (f.arrival > i.arrival) break;
    if (f.utime == i.utime) found = &f;
  }
  return found;
}

bool is_accepted_fix(const DrillInnovation& i) {
  return i.accepted && i.source == innovation_t::SOURCE_GPS_POSITION;
}

bool about_gps(const Stimulus& s) {
  return s.source == DrillSource::kGps || s.source == DrillSource::kAll;
}

/// The alert bits of a source.
bool alerts(const DrillIntegrity& i, DrillSource source) {
  const bool gps =
      (i.alerts & integrity_t::ALERT_GPS) != 0 || i.gps != integrity_t::STATUS_ACCEPTED;
  const bool ladar =
      (i.alerts & integrity_t::ALERT_LADAR) != 0 || i.ladar != integrity_t::STATUS_ACCEPTED;
  if (source == DrillSource::kGps) return gps;
  if (source == DrillSource::kLadar) return ladar;
  return gps || ladar || i.alerts != 0;
}

bool near_a_stimulus(const Drill& drill, double t_s) {
  return std::any_of(drill.stimuli.begin(), drill.stimuli.end(), [t_s](const Stimulus& s) {
    return t_s >= s.begin_s && t_s < s.end_s() + kSettle_s;
  });
}

void find_time_to_alert(const Drill& drill, const DrillRecord& record, const DrillErrors& errors,
                        IntegrityMetrics* f) {
  for (const Stimulus& s : drill.stimuli) {
    if (!s.corrupts() || s.length_s < kMissedAfter_s || s.count > 0) continue;
    f->alert_expected = true;
    const auto first = std::find_if(
        record.integrity.begin(), record.integrity.end(), [&](const DrillIntegrity& i) {
          return errors.time_s(i.stamp) >= s.begin_s && alerts(i, s.source);
        });
    const double after_s =
        first == record.integrity.end() ? 1e9 : errors.time_s(first->stamp) - s.begin_s;
    f->time_to_alert_s = std::max(f->time_to_alert_s.value_or(0.0), after_s);
  }
  if (f->time_to_alert_s && *f->time_to_alert_s >= 1e9) f->time_to_alert_s.reset();
}

void count_false_alerts(const Drill& drill, const DrillRecord& record, const DrillErrors& errors,
                        IntegrityMetrics* f) {
  double calm_s = 0.0;
  int count = 0;
  const DrillIntegrity* last = nullptr;
  for (const DrillIntegrity& i : record.integrity) {
    const DrillIntegrity* before = std::exchange(last, &i);
    const double t_s = errors.time_s(i.stamp);
    if (before == nullptr || t_s < kSettle_s || near_a_stimulus(drill, t_s)) continue;
    calm_s += std::max(0.0, seconds(i.stamp - before->stamp));
    const std::optional<DrillError> e = errors.at(i.stamp);
    const bool fine =
        e && e->horizontal_m() <= i.limit_horizontal_m && e->vertical_m() <= i.limit_vertical_m;
    if (fine && i.alerts != 0 && before->alerts == 0) ++count;
  }
  if (calm_s > 0.0) f->false_alerts_per_h = count * 3600.0 / calm_s;
}

}  // namespace

std::vector<FalseAcceptance> false_acceptances(const DrillRecord& record,
                                               const DrillErrors& errors) {
  std::vector<FalseAcceptance> found;
  for (const DrillInnovation& i : record.innovations) {
    if (!is_accepted_fix(i)) continue;
    const DrillFix* fix = fix_of(record, i);
    if (fix == nullptr) continue;
    const std::optional<Vec3> e = fix_error(record, errors, *fix);
    if (!e) continue;
    const double t_s = errors.time_s(fix->arrival);
    if (!e->allFinite()) {
      found.push_back({t_s, e->norm(), e->norm()});
      continue;
    }
    Mat3 total = fix->sigma_m.cwiseProduct(fix->sigma_m).asDiagonal();
    // The belief of WM before this fix.
    if (const DrillBelief* b = errors.belief_at(fix->stamp - Duration(1))) {
      const Mat3 R = b->T_world_vehicle.rotation();
      total += R * b->cov_world_pose.topLeftCorner<3, 3>() * R.transpose();
    }
    Vec3 taken = *e;
    if (i.dof == 2) {  // without height
      taken.z() = 0.0;
      total.row(2).setZero();
      total.col(2).setZero();
      total(2, 2) = 1.0;
    }
    const double sigmas = sigmas_of(taken, total);
    if (sigmas > kFalseSigmas) found.push_back({t_s, taken.norm(), sigmas});
  }
  return found;
}

std::vector<GpsReturn> gps_returns(const Drill& drill, const DrillRecord& record,
                                   const DrillErrors& errors) {
  std::vector<GpsReturn> returns;
  for (const Stimulus& s : drill.stimuli) {
    if (!about_gps(s)) continue;
    const Stamp end = errors.stamp_at(s.end_s());
    const auto clean = std::find_if(
        record.fixes.begin(), record.fixes.end(),
        [&](const DrillFix& f) { return f.arrival >= end && is_clean(record, errors, f); });
    if (clean == record.fixes.end()) continue;
    GpsReturn r;
    r.clean_s = errors.time_s(clean->arrival);
    for (const DrillInnovation& i : record.innovations) {
      if (i.arrival < clean->arrival || !is_accepted_fix(i)) continue;
      const DrillFix* fix = fix_of(record, i);
      if (fix == nullptr || fix->arrival < clean->arrival || !is_clean(record, errors, *fix)) {
        continue;
      }
      r.accepted_after_s = seconds(fix->arrival - clean->arrival);
      break;
    }
    returns.push_back(r);
  }
  return returns;
}

std::optional<IntegrityMetrics> integrity_metrics(const Drill& drill, const DrillRecord& record,
                                                  const DrillErrors& errors) {
  if (record.integrity.empty()) return std::nullopt;
  IntegrityMetrics f;
  std::size_t horizontal = 0;
  std::size_t vertical = 0;
  std::optional<double> above_since_s;  // without an alert
  bool counted = false;
  for (const DrillIntegrity& i : record.integrity) {
    const double t_s = errors.time_s(i.stamp);
    const std::optional<DrillError> e = errors.at(i.stamp);
    if (t_s < drill.begin_s() || !e) continue;
    if (!std::isfinite(i.horizontal_m)) {  // no bound published
      above_since_s.reset();
      continue;
    }
    ++f.samples;
    const bool within_horizontal = e->horizontal_m() <= i.horizontal_m;
    const bool within_vertical = e->vertical_m() <= i.vertical_m;
    horizontal += within_horizontal ? 1 : 0;
    vertical += within_vertical ? 1 : 0;
    if ((within_horizontal && within_vertical) || i.alerts != 0) {
      above_since_s.reset();
      counted = false;
      continue;
    }
    if (!above_since_s) above_since_s = t_s;
    if (!counted && t_s - *above_since_s >= kMissedAfter_s) {
      ++f.missed_alerts;
      counted = true;
    }
  }
  if (f.samples > 0) {
    f.within_horizontal = static_cast<double>(horizontal) / static_cast<double>(f.samples);
    f.within_vertical = static_cast<double>(vertical) / static_cast<double>(f.samples);
  }
  find_time_to_alert(drill, record, errors, &f);
  count_false_alerts(drill, record, errors, &f);
  return f;
}

}  // namespace rcs::drills

#include "tools/drills/drill_result.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/base/statistics.h"

namespace rcs::drills {
namespace {

using Runs = std::vector<DrillRunMetrics>;

LimitResult without(std::string note) {
  LimitResult r;
  r.note = std::move(note);
  return r;
}

LimitResult with(double value) {
  LimitResult r;
  r.value = value;
  return r;
}

/// Drift of the longest outage of each run, over the runs.
LimitResult drift(const Runs& runs, double share) {
  std::vector<double> pct;
  for (const DrillRunMetrics& run : runs) {
    const auto longest = std::max_element(run.outages.begin(), run.outages.end(),
                                          [](const OutageDrift& a, const OutageDrift& b) {
                                            return a.window.length_s() < b.window.length_s();
                                          });
    if (longest != run.outages.end()) pct.push_back(longest->drift_pct);
  }
  if (pct.empty()) return without("no outage");
  std::sort(pct.begin(), pct.end());
  return with(tools::percentile(pct, share));
}

LimitResult time_to_alert(const Runs& runs) {
  double worst_s = 0.0;
  bool any = false;
  for (const DrillRunMetrics& run : runs) {
    if (!run.integrity->alert_expected) continue;
    if (!run.integrity->time_to_alert_s) return without("never");
    worst_s = std::max(worst_s, *run.integrity->time_to_alert_s);
    any = true;
  }
  return any ? with(worst_s) : without("no false source that lasts 2 s or longer");
}

LimitResult accepted_after(const Runs& runs) {
  double worst_s = 0.0;
  bool any = false;
  for (const DrillRunMetrics& run : runs) {
    for (const GpsReturn& r : run.returns) {
      if (!r.accepted_after_s) return without("never");
      worst_s = std::max(worst_s, *r.accepted_after_s);
      any = true;
    }
  }
  return any ? with(worst_s) : without("no clean fix after the fault");
}

LimitResult ratio(const Runs& runs) {
  double worst = 0.0;
  std::string note;
  const Baselines sums = pooled_baselines(runs);
  for (std::size_t k = 0; k < sums.size(); ++k) {
    if (sums[k].samples == 0 || sums[k].ratio() <= worst) continue;
    worst = sums[k].ratio();
    note = subfilter_name(static_cast<int>(k));
  }
  if (note.empty()) return without("no baseline");
  LimitResult r = with(worst);
  r.note = "to " + note;
  if (!runs.front().subfilters_published) r.note += " (separate run: sub-filters not published)";
  return r;
}

/// @param f  of one run
template <class F>
LimitResult worst(const Runs& runs, F f) {
  double value = f(runs.front());
  for (const DrillRunMetrics& run : runs) value = std::max(value, static_cast<double>(f(run)));
  return with(value);
}
template <class F>
LimitResult total(const Runs& runs, F f) {
  double value = 0.0;
  for (const DrillRunMetrics& run : runs) value += static_cast<double>(f(run));
  return with(value);
}
template <class F>
LimitResult mean(const Runs& runs, F f) {
  return with(*total(runs, f).value / static_cast<double>(runs.size()));
}

LimitResult metric(std::string_view key, const Runs& runs) {
  if (key == "drift_pct_median") return drift(runs, 0.5);
  if (key == "drift_pct_p95") return drift(runs, 0.95);
  if (key == "false_acceptances") {
    return total(runs, [](const DrillRunMetrics& r) { return r.false_acceptances.size(); });
  }
  if (key == "smooth_step_m") {
    return worst(runs, [](const DrillRunMetrics& r) { return r.smooth.m; });
  }
  if (key == "alarm_within_s") return time_to_alert(runs);
  if (key == "accept_within_s") return accepted_after(runs);
  if (key == "within_protection") {
    return mean(runs, [](const DrillRunMetrics& r) {
      return std::min(r.integrity->within_horizontal, r.integrity->within_vertical);
    });
  }
  if (key == "missed_alerts") {
    return total(runs, [](const DrillRunMetrics& r) { return r.integrity->missed_alerts; });
  }
  if (key == "false_alerts_per_h") {
    return mean(runs, [](const DrillRunMetrics& r) { return r.integrity->false_alerts_per_h; });
  }
  if (key == "ratio") return ratio(runs);
  if (key == "horizontal_m") {
    return worst(runs, [](const DrillRunMetrics& r) { return r.accuracy.horizontal_max_m; });
  }
  return total(runs, [](const DrillRunMetrics& r) { return r.overruns + r.missed; });
}

bool needs_more_seeds(std::string_view key, std::size_t seeds) {
  if (key == "drift_pct_median") return seeds < kSeedsForMedian;
  return key == "ratio" && seeds < kSeedsForRatio;
}

}  // namespace

DrillRunMetrics drill_metrics(const Drill& drill, std::int64_t seed, const DrillRecord& record) {
  const DrillErrors errors(record);
  DrillRunMetrics f;
  f.seed = seed;
  f.simulated_s = record.begin ? seconds(record.end - *record.begin) : 0.0;
  f.accuracy = accuracy(drill, errors);
  f.outages = outage_drifts(drill, record, errors);
  f.smooth = largest_smooth_step(drill, record);
  f.nis = nis_metrics(record);
  f.false_acceptances = false_acceptances(record, errors);
  f.returns = gps_returns(drill, record, errors);
  f.integrity = integrity_metrics(drill, record, errors);
  f.baselines = subfilter_baselines(drill, record, errors);
  f.subfilters_published = !record.subfilters.empty();
  f.stops = record.stops;
  f.overruns = record.overruns;
  f.missed = record.missed;
  f.hash = record.hash;
  return f;
}

LimitResult drill_metric(const LimitKind& kind, const Runs& runs) {
  LimitResult r;
  const bool published = std::all_of(runs.begin(), runs.end(), [](const DrillRunMetrics& run) {
    return run.integrity.has_value();
  });
  const bool judged = std::all_of(runs.begin(), runs.end(), [](const DrillRunMetrics& run) {
    return run.accuracy.samples > 0;
  });
  if (runs.empty()) {
    r = without("no completed run");
  } else if (!judged) {
    r = without("no world pose, or no truth");
  } else if (kind.needs_integrity && !published) {
    r = without("not published");
  } else {
    r = metric(kind.key, runs);
  }
  r.kind = &kind;
  return r;
}

std::vector<LimitResult> judge(const Drill& drill, const Runs& runs) {
  std::vector<LimitResult> results;
  for (const LimitKind& kind : kLimits) {
    const auto found = drill.limits.find(kind.key);
    if (found == drill.limits.end()) continue;
    LimitResult r = drill_metric(kind, runs);
    r.limit = found->second;
    if (r.value && needs_more_seeds(kind.key, runs.size())) {
      r.verdict = Verdict::kInconclusive;
      r.note += fmt::format("{}{} of {} seeds", r.note.empty() ? "" : "; ", runs.size(),
                            kind.key == "ratio" ? kSeedsForRatio : kSeedsForMedian);
    } else {
      const bool passes = r.value && (kind.at_least ? *r.value >= r.limit : *r.value <= r.limit);
      r.verdict = passes ? Verdict::kPass : Verdict::kFail;
    }
    results.push_back(std::move(r));
  }
  return results;
}

Baselines pooled_baselines(const Runs& runs) {
  Baselines sums;
  for (const DrillRunMetrics& run : runs) {
    for (std::size_t k = 0; k < sums.size(); ++k) {
      sums[k].samples += run.baselines[k].samples;
      sums[k].fused_m2 += run.baselines[k].fused_m2;
      sums[k].baseline_m2 += run.baselines[k].baseline_m2;
    }
  }
  return sums;
}

Verdict DrillResult::verdict() const {
  if (!error.empty()) return Verdict::kFail;
  bool passes = false;
  for (const LimitResult& m : limits) {
    if (m.verdict == Verdict::kFail) return Verdict::kFail;
    passes = passes || m.verdict == Verdict::kPass;
  }
  return passes ? Verdict::kPass : Verdict::kInconclusive;
}

}  // namespace rcs::drills

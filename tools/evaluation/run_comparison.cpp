#include "tools/evaluation/run_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace rcs::evaluation {
namespace {

using report::fixed;

bool in_any(const std::vector<TimeInterval>& intervals, Stamp stamp) {
  return std::any_of(intervals.begin(), intervals.end(),
                     [stamp](const TimeInterval& i) { return i.contains(stamp); });
}

std::string joined(const std::vector<std::string>& names, std::string_view separator) {
  std::string text;
  for (const std::string& name : names) {
    if (!text.empty()) text += separator;
    text += name;
  }
  return text;
}

/// The sources without the LADAR and the a priori map, which requires it.
std::vector<std::string> others(std::vector<std::string> fused) {
  const auto of_ladar = [](const std::string& s) { return s == "LADAR" || s == "a priori map"; };
  fused.erase(std::remove_if(fused.begin(), fused.end(), of_ladar), fused.end());
  return fused;
}

/// Two runs that differ only by the LADAR in one outage.
struct LadarPair {
  double with_m = 0.0;  ///< RMS
  double without_m = 0.0;
  std::vector<std::string> others_fused;  ///< what both fused

  [[nodiscard]] double factor() const { return without_m / std::max(1e-6, with_m); }
};

std::vector<LadarPair> ladar_pairs(const std::vector<ComparedRun>& runs, std::size_t outage) {
  const auto has_ladar = [outage](const ComparedRun& run) {
    const std::vector<std::string>& fused = run.fused[outage];
    return std::find(fused.begin(), fused.end(), "LADAR") != fused.end();
  };
  std::vector<LadarPair> pairs;
  for (const ComparedRun& with : runs) {
    for (const ComparedRun& without : runs) {
      if (!with.with_truth || !without.with_truth) continue;
      if (!has_ladar(with) || has_ladar(without)) continue;
      std::vector<std::string> others_fused = others(with.fused[outage]);
      if (others_fused != others(without.fused[outage])) continue;
      pairs.push_back({with.outages[outage].horizontal_m.rms,
                       without.outages[outage].horizontal_m.rms, std::move(others_fused)});
    }
  }
  return pairs;
}

std::string labelled(const ComparedRun& run, std::size_t outage) {
  const std::vector<std::string>& fused = run.fused[outage];
  if (fused.empty()) return run.name + ": nothing";
  return run.name + ": " + joined(fused, ", ");
}

std::string first_header(bool denied) {
  return denied ? "run: sources fused while GPS is denied" : "run: sources fused in the interval";
}

/// Of runs without a truth.
report::Table uncertainty_table(const std::vector<ComparedRun>& runs) {
  report::Table t{{first_header(gps_denied(runs)), "driven [m]", "sigma at the end [m]",
                   "protection level at the end [m]"},
                  {}};
  const auto metres = [](double v) { return std::isfinite(v) ? fixed(v, 2) : std::string("-"); };
  for (const ComparedRun& run : runs) {
    if (run.outages.empty()) t.rows.push_back({run.name, "-", "-", "-"});
    for (std::size_t k = 0; k < run.outages.size(); ++k) {
      t.rows.push_back({labelled(run, k), fixed(run.outages[k].driven_m, 0),
                        metres(run.uncertainty[k].sigma_horizontal_m),
                        metres(run.uncertainty[k].protection_horizontal_m)});
    }
  }
  t.note =
      "horizontal, as WM published them at the end of the interval; sigma: standard deviation in "
      "the worst direction; protection level: bound that the error exceeds with a probability of "
      "0.001; driven: by the estimate; -: not known, or GPS was not denied";
  return t;
}

}  // namespace

ComparedRun compare_run(const std::string& name, const recording::RunLog& log,
                        const RunTrace& trace, const WorldMetrics* world,
                        const std::vector<TimeInterval>& outages) {
  ComparedRun run;
  run.name = name;
  run.with_truth = world != nullptr;
  if (world != nullptr) {
    run.nees_per_dof = world->nees_per_dof;
    std::vector<double> with_gps_m;
    for (const WorldError& e : world->errors) {
      if (!in_any(outages, e.stamp)) with_gps_m.push_back(e.horizontal_m());
    }
    run.with_gps_m = tools::summarize(std::move(with_gps_m));
  }
  for (const TimeInterval& i : outages) {
    OutageMetrics outage;
    outage.interval = i;
    if (world == nullptr) outage.driven_m = distance_driven_m(log, i);
    run.outages.push_back(world != nullptr ? outage_metrics(*world, i) : std::move(outage));
    run.fused.push_back(fused_sources(log, i));
    run.uncertainty.push_back(uncertainty_at_end(log, trace, i));
  }
  return run;
}

bool gps_denied(const std::vector<ComparedRun>& runs) {
  for (const ComparedRun& run : runs) {
    for (const std::vector<std::string>& fused : run.fused) {
      if (std::find(fused.begin(), fused.end(), "GPS") != fused.end()) return false;
    }
  }
  return true;
}

report::Table comparison_table(const std::vector<ComparedRun>& runs) {
  const bool without_truth =
      std::any_of(runs.begin(), runs.end(), [](const ComparedRun& run) { return !run.with_truth; });
  if (without_truth) return uncertainty_table(runs);
  const bool denied = gps_denied(runs);
  report::Table t{{first_header(denied), denied ? "with GPS, rms [m]" : "outside, rms [m]",
                   denied ? "denied: rms [m]" : "rms [m]", "95 % [m]", "max [m]", "at the end [m]",
                   "rms / distance"},
                  {}};
  for (const ComparedRun& run : runs) {
    const std::string with_gps = fixed(run.with_gps_m.rms, 2);
    if (run.outages.empty()) t.rows.push_back({run.name, with_gps, "-", "-", "-", "-", "-"});
    for (std::size_t k = 0; k < run.outages.size(); ++k) {
      const OutageMetrics& o = run.outages[k];
      const std::string share =
          o.driven_m > 0.0 ? fixed(100.0 * o.horizontal_m.rms / o.driven_m, 2) + " %" : "-";
      t.rows.push_back({labelled(run, k), with_gps, fixed(o.horizontal_m.rms, 2),
                        fixed(o.horizontal_m.p95, 2), fixed(o.horizontal_m.max, 2),
                        fixed(o.end_horizontal_m, 2), share});
    }
  }
  t.note =
      "horizontal errors against the ground truth (SIM_TRUTH); rms: root mean square; 95 %: "
      "percentile; rms / distance: rms over the distance driven in the interval; ";
  t.note += denied ? "-: GPS was not denied" : "outside: of the interval";
  return t;
}

std::optional<double> ladar_factor(const std::vector<ComparedRun>& runs) {
  if (runs.empty()) return std::nullopt;
  std::optional<double> smallest;
  for (std::size_t k = 0; k < runs.front().outages.size(); ++k) {
    double largest = 0.0;
    for (const LadarPair& pair : ladar_pairs(runs, k)) largest = std::max(largest, pair.factor());
    if (largest <= 0.0) return std::nullopt;
    smallest = std::min(smallest.value_or(largest), largest);
  }
  return smallest;
}

std::string comparison_text(const std::vector<ComparedRun>& runs) {
  if (runs.empty()) return {};
  std::string text;
  for (std::size_t k = 0; k < runs.front().outages.size(); ++k) {
    const OutageMetrics& o = runs.front().outages[k];
    std::string errors;
    for (const LadarPair& pair : ladar_pairs(runs, k)) {
      errors += fmt::format("{}{:.2f} m and {:.2f} m (with {})", errors.empty() ? "" : "; ",
                            pair.with_m, pair.without_m, joined(pair.others_fused, ", "));
    }
    if (errors.empty()) continue;
    text += fmt::format(
        "{}Contribution of the LADAR: over {:.0f} s and {:.0f} m without GPS the rms error with "
        "and without the LADAR, other sensors being equal, is {}.",
        text.empty() ? "" : "\n", seconds(o.interval.to - o.interval.from), o.driven_m, errors);
  }
  return text;
}

Json to_json(const ComparedRun& run, Stamp zero) {
  Json json = {{"name", run.name},
               {"with_gps_horizontal_rms_m", run.with_gps_m.rms},
               {"with_gps_horizontal_max_m", run.with_gps_m.max},
               {"outages", Json::array()}};
  for (std::size_t k = 0; k < run.outages.size(); ++k) {
    Json outage = to_json(run.outages[k], zero);
    outage["fused"] = run.fused[k];
    json["outages"].push_back(std::move(outage));
  }
  if (run.with_truth) return json;
  for (const char* error : {"with_gps_horizontal_rms_m", "with_gps_horizontal_max_m"}) {
    json[error] = nullptr;
  }
  for (Json& outage : json["outages"]) {
    for (const char* error : {"start_horizontal_m", "horizontal_m", "end_horizontal_m",
                              "drift_percent", "nees_per_dof"}) {
      outage[error] = nullptr;
    }
  }
  return json;
}

}  // namespace rcs::evaluation

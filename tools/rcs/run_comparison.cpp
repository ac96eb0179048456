#include "tools/rcs/run_comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace rcs::tools {
namespace {

std::string fixed(double v, int digits) { return fmt::format("{:.{}f}", v, digits); }

bool in_any(const std::vector<Interval>& intervals, Stamp stamp) {
  return std::any_of(intervals.begin(), intervals.end(),
                     [stamp](const Interval& i) { return i.contains(stamp); });
}

/// Of `a`, those that `b` does not have.
std::vector<std::string> less(const std::vector<std::string>& a,
                              const std::vector<std::string>& b) {
  std::vector<std::string> rest;
  std::copy_if(a.begin(), a.end(), std::back_inserter(rest), [&](const std::string& name) {
    return std::find(b.begin(), b.end(), name) == b.end();
  });
  return rest;
}

std::string labelled(const ComparedRun& run, std::size_t outage) {
  const std::vector<std::string>& fused = run.fused[outage];
  if (fused.empty()) return run.name + ": nothing";
  return fmt::format("{}: {}", run.name, fmt::join(fused, ", "));
}

}  // namespace

ComparedRun compare_run(const std::string& name, const RunLog& log, const WorldFigures& world,
                        const std::vector<Interval>& outages) {
  ComparedRun run;
  run.name = name;
  run.nees_per_dof = world.nees_per_dof;
  std::vector<double> with_gps_m;
  for (const WorldError& e : world.errors) {
    if (!in_any(outages, e.stamp)) with_gps_m.push_back(e.horizontal_m());
  }
  run.with_gps_m = summarize(std::move(with_gps_m));
  for (const Interval& i : outages) {
    run.outages.push_back(outage_figures(world, i));
    run.fused.push_back(fused_sources(log, i));
  }
  return run;
}

Table comparison_table(const std::vector<ComparedRun>& runs) {
  Table t{{"run: what it fuses while GPS is denied", "with GPS, rms [m]", "denied: rms [m]",
           "95 % [m]", "max [m]", "at the end [m]", "rms / distance"},
          {}};
  for (const ComparedRun& run : runs) {
    const std::string with_gps = fixed(run.with_gps_m.rms, 2);
    if (run.outages.empty()) t.rows.push_back({run.name, with_gps, "-", "-", "-", "-", "-"});
    for (std::size_t k = 0; k < run.outages.size(); ++k) {
      const OutageFigures& o = run.outages[k];
      const std::string share =
          o.driven_m > 0.0 ? fixed(100.0 * o.horizontal_m.rms / o.driven_m, 2) + " %" : "-";
      t.rows.push_back({labelled(run, k), with_gps, fixed(o.horizontal_m.rms, 2),
                        fixed(o.horizontal_m.p95, 2), fixed(o.horizontal_m.max, 2),
                        fixed(o.end_horizontal_m, 2), share});
    }
  }
  return t;
}

std::optional<double> error_factor(const std::vector<ComparedRun>& runs) {
  if (runs.size() < 2) return std::nullopt;
  std::optional<double> smallest;
  for (std::size_t k = 0; k < runs[0].outages.size(); ++k) {
    const double first_m = runs[0].outages[k].horizontal_m.rms;
    if (!(first_m > 0.0)) return std::nullopt;
    const double factor = runs[1].outages[k].horizontal_m.rms / first_m;
    smallest = std::min(smallest.value_or(factor), factor);
  }
  return smallest;
}

std::string comparison_text(const std::vector<ComparedRun>& runs) {
  if (!error_factor(runs)) return {};
  const ComparedRun& first = runs[0];
  const ComparedRun& second = runs[1];
  std::string text;
  for (std::size_t k = 0; k < first.outages.size(); ++k) {
    const OutageFigures& o = first.outages[k];
    const double first_m = o.horizontal_m.rms;
    const double second_m = second.outages[k].horizontal_m.rms;
    const std::vector<std::string> gained = less(first.fused[k], second.fused[k]);
    const std::vector<std::string> changed = less(second.fused[k], first.fused[k]);
    const bool one_more = !gained.empty() && changed.empty();
    const std::string with = one_more ? fmt::format("with {}", fmt::join(gained, " and "))
                                      : fmt::format("in '{}'", first.name);
    const std::string without = one_more ? "without" : fmt::format("in '{}'", second.name);
    text += fmt::format(
        "{}Look at the rms of the first two rows: over {:.0f} s and {:.0f} m without GPS the "
        "horizontal error is {:.2f} m rms {} and {:.2f} m {}, on the same sensor data: {:.1f} "
        "times as much.",
        text.empty() ? "" : "\n", seconds(o.interval.to - o.interval.from), o.driven_m, first_m,
        with, second_m, without, second_m / first_m);
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
  return json;
}

}  // namespace rcs::tools

#include "tools/studies/map_study.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "tools/drills/drill_metrics.h"
#include "tools/report/svg_plot.h"
#include "tools/studies/consistency_metrics.h"

namespace rcs::studies {
namespace {

/// 95 % quantile of the chi-square distribution with 3 degrees of freedom.
constexpr double k95Percent = 7.8147;
/// Lower bound of the denominator of the ratio: smaller errors need no map.
constexpr double kFloor_m = 0.2;

double quantile(std::vector<double>* values, double share) {
  if (values->empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values->size() - 1));
  std::nth_element(values->begin(), values->begin() + at, values->end());
  return (*values)[static_cast<std::size_t>(at)];
}

std::string name_of(const MapStudyBlock& block) {
  return std::filesystem::path(block.scenario).stem().string();
}

/// The drives of the scenario without a map; nullptr: not requested, or failed.
const MapStudyBlock* without_map(const std::vector<MapStudyBlock>& blocks,
                                 const MapStudyBlock& block) {
  for (const MapStudyBlock& b : blocks) {
    if (b.scenario == block.scenario && !b.cell_m) return b.error.empty() ? &b : nullptr;
  }
  return nullptr;
}

/// RMS over all runs divided by that without a map.
std::optional<double> ratio_of(const std::vector<MapStudyBlock>& blocks,
                               const MapStudyBlock& block) {
  const MapStudyBlock* const without = without_map(blocks, block);
  if (without == nullptr || without == &block) return std::nullopt;
  return map_study_metrics(block).rms_m / std::max(kFloor_m, map_study_metrics(*without).rms_m);
}

}  // namespace

drills::Drill MapStudyPlan::drill(const std::string& scenario, std::optional<double> cell_m) const {
  drills::Drill drill;
  drill.id = std::filesystem::path(scenario).stem().string() +
             (cell_m ? fmt::format(", map of {:g} m", *cell_m) : ", no map");
  drill.name = drill.id;
  drill.needs_simulator = true;
  drill.run.scenario = scenario;
  drill.run.ins = ins;
  drill.run.length_s = length_s;
  drill.run.prior_map = cell_m.has_value();
  drill.run.map_cell_m = cell_m.value_or(0.0);
  drill.stimuli = {drills::dropout(drills::DrillSource::kGps, gps_lost_s, drills::kForGood_s)};
  return drill;
}

MapStudyRun map_study_run(const MapStudyPlan& plan, const drills::DrillRecord& record) {
  const drills::DrillErrors errors(record);
  MapStudyRun run;
  if (!record.begin) return run;
  const Stamp first = errors.stamp_at(plan.gps_lost_s);
  run.driven_m = errors.driven_m(first, record.end);
  double slopes = 0.0;
  for (Stamp t = first + std::chrono::seconds(1); t < record.end; t += std::chrono::seconds(1)) {
    const drills::DrillBelief* const belief = errors.belief_at(t);
    const std::optional<Pose> truth =
        belief == nullptr ? std::nullopt : errors.truth_at(belief->stamp);
    const std::optional<PartError> error =
        truth ? part_errors(*belief, *truth, std::nullopt)[0] : std::nullopt;
    if (!error) {
      ++run.missing;
      continue;
    }
    run.error_m.push_back(error->error);
    run.horizontal_m.push_back((belief->T_world_vehicle.p - truth->p).head<2>().norm());
    run.inside += error->nees <= k95Percent ? 1 : 0;
    const double level = std::clamp((truth->q * Vec3::UnitZ()).z(), -1.0, 1.0);
    slopes += std::pow(std::acos(level), 2);
  }
  if (!run.error_m.empty()) {
    run.slope_rms_rad = std::sqrt(slopes / static_cast<double>(run.error_m.size()));
  }
  return run;
}

MapStudyMetrics map_study_metrics(const MapStudyBlock& block) {
  MapStudyMetrics f;
  std::vector<double> errors;
  std::vector<double> horizontal;
  double slopes = 0.0;
  for (const MapStudyRun& run : block.runs) {
    errors.insert(errors.end(), run.error_m.begin(), run.error_m.end());
    horizontal.insert(horizontal.end(), run.horizontal_m.begin(), run.horizontal_m.end());
    f.inside += static_cast<double>(run.inside);
    f.missing += run.missing;
    f.driven_m += run.driven_m;
    slopes += run.slope_rms_rad * run.slope_rms_rad;
  }
  f.samples = errors.size();
  if (errors.empty()) return f;
  double squares = 0.0;
  for (const double e : errors) squares += e * e;
  const auto n = static_cast<double>(errors.size());
  f.rms_m = std::sqrt(squares / n);
  f.inside /= n;
  f.slope_rms_rad = std::sqrt(slopes / static_cast<double>(block.runs.size()));
  f.max_m = *std::max_element(errors.begin(), errors.end());
  f.median_m = quantile(&errors, 0.5);
  f.p95_m = quantile(&errors, 0.95);
  f.horizontal_p95_m = quantile(&horizontal, 0.95);
  return f;
}

report::Table map_study_table(const std::vector<MapStudyBlock>& blocks) {
  report::Table table;
  table.header = {"drive",          "slope [deg]",   "map [m]",        "drives",
                  "km without GPS", "error median",  "95 %",           "max [m]",
                  "in plane 95 %",  "RMS to no map", "inside 95 % [%]"};
  for (const MapStudyBlock& block : blocks) {
    const std::string map = block.cell_m ? fmt::format("{:g}", *block.cell_m) : "none";
    if (!block.error.empty()) {
      std::vector<std::string> row(table.header.size(), "-");
      row[0] = name_of(block);
      row[2] = map;
      table.rows.push_back(std::move(row));
      continue;
    }
    const MapStudyMetrics f = map_study_metrics(block);
    const std::optional<double> ratio = ratio_of(blocks, block);
    table.rows.push_back(
        {name_of(block), fmt::format("{:.1f}", degrees(f.slope_rms_rad)), map,
         fmt::format("{}", block.runs.size()), fmt::format("{:.1f}", f.driven_m / 1000.0),
         fmt::format("{:.2f}", f.median_m), fmt::format("{:.2f}", f.p95_m),
         fmt::format("{:.2f}", f.max_m), fmt::format("{:.2f}", f.horizontal_p95_m),
         ratio ? fmt::format("{:.3f}", *ratio) : "-", fmt::format("{:.1f}", 100.0 * f.inside)});
  }
  table.note =
      "errors on three axes without GPS [m]; map: cell size; in plane: horizontal; RMS to no map: "
      "RMS error over that without a map, above 1 the map is harmful; inside 95 %: of the true "
      "positions in the ellipsoid of WM; -: failed, or not defined";
  return table;
}

nlohmann::ordered_json map_study_json(const std::vector<MapStudyBlock>& blocks) {
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const MapStudyBlock& block : blocks) {
    nlohmann::ordered_json row = {{"scenario", block.scenario}};
    row["map_cell_m"] = block.cell_m ? nlohmann::ordered_json(*block.cell_m) : nullptr;
    if (!block.error.empty()) {
      row["error"] = block.error;
      rows.push_back(std::move(row));
      continue;
    }
    const MapStudyMetrics f = map_study_metrics(block);
    const std::optional<double> ratio = ratio_of(blocks, block);
    row["drives"] = block.runs.size();
    row["driven_m"] = f.driven_m;
    row["slope_rms_deg"] = degrees(f.slope_rms_rad);
    row["seconds"] = f.samples;
    row["seconds_without_belief"] = f.missing;
    row["error_median_m"] = f.median_m;
    row["error_p95_m"] = f.p95_m;
    row["error_max_m"] = f.max_m;
    row["error_rms_m"] = f.rms_m;
    row["horizontal_p95_m"] = f.horizontal_p95_m;
    row["ratio_to_no_map"] = ratio ? nlohmann::ordered_json(*ratio) : nullptr;
    row["inside_95"] = f.inside;
    rows.push_back(std::move(row));
  }
  return {{"rows", std::move(rows)}};
}

std::string map_study_svg(const std::vector<MapStudyBlock>& blocks) {
  constexpr std::array kColours = {report::Colour::kBlue, report::Colour::kOrange,
                                   report::Colour::kGreen, report::Colour::kPurple,
                                   report::Colour::kGrey};
  report::Plot plot;
  plot.title = "Error without GPS against resolution of the a priori map";
  plot.x_label = "cell of the map [m]";
  plot.y_label = "position error, 95 % [m]";
  plot.log_x = true;
  plot.log_y = true;
  std::vector<std::string> scenarios;
  double low_m = 1e9;
  double high_m = 0.0;
  for (const MapStudyBlock& b : blocks) {
    if (!b.error.empty()) continue;
    if (std::find(scenarios.begin(), scenarios.end(), b.scenario) == scenarios.end()) {
      scenarios.push_back(b.scenario);
    }
    if (b.cell_m) low_m = std::min(low_m, *b.cell_m);
    if (b.cell_m) high_m = std::max(high_m, *b.cell_m);
  }
  for (std::size_t k = 0; k < scenarios.size(); ++k) {
    const report::Colour colour = kColours[k % kColours.size()];
    report::Series with{"", colour, report::SeriesStyle::kThickLine, {}, {}, {}};
    report::Series without{"", colour, report::SeriesStyle::kDashed, {low_m, high_m}, {}, {}};
    for (const MapStudyBlock& b : blocks) {
      if (b.scenario != scenarios[k] || !b.error.empty()) continue;
      const MapStudyMetrics f = map_study_metrics(b);
      if (!b.cell_m) {
        without.label = name_of(b) + ", no map";
        without.y = {f.p95_m, f.p95_m};
        continue;
      }
      with.label = fmt::format("{} (slopes {:.0f} deg)", name_of(b), degrees(f.slope_rms_rad));
      with.x.push_back(*b.cell_m);
      with.y.push_back(f.p95_m);
    }
    if (!with.x.empty()) plot.series.push_back(std::move(with));
    if (!without.y.empty()) plot.series.push_back(std::move(without));
  }
  return report::render(plot, true);
}

}  // namespace rcs::studies

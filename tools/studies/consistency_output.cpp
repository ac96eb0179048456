#include "tools/studies/consistency_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "tools/drills/drill_output.h"

namespace rcs::studies {
namespace {

using Json = nlohmann::ordered_json;

std::string nees_text(const PartMetrics& f) {
  const std::string metric = f.count == 0 ? "-" : fmt::format("{:.2f}", f.nees_per_dof);
  return f.missing == 0 ? metric : fmt::format("{} ({} missing)", metric, f.missing);
}

/// Scenario and INS of a block, shown in its first row.
std::vector<std::string> row_head(const ConsistencyBlock& block, StatePart part) {
  const bool first = part == kStateParts.front();
  return {first ? scenario_name(block.scenario) : "", first ? block.ins : "",
          std::string(part_name(part))};
}

std::set<std::string> sources_of(const ConsistencyReport& report) {
  std::set<std::string> sources;
  for (const ConsistencyBlock& block : report.blocks) {
    for (const auto& [source, sums] : pooled_innovations(block)) sources.insert(source);
  }
  return sources;
}

Json interval_json(const ValueInterval& i) { return Json::array({i.low, i.high}); }

Json part_json(const ConsistencyPlan& plan, const ConsistencyBlock& block, StatePart part) {
  Json j = {{"at", Json::array()}};
  for (std::size_t k = 0; k < plan.times_s.size(); ++k) {
    const PartMetrics f = metrics_at(block, k, part);
    Json at = {{"t_s", plan.times_s[k]},
               {"moment", moment_text(plan, plan.times_s[k])},
               {"runs", f.count},
               {"missing", f.missing},
               {"nees_per_dof", f.nees_per_dof},
               {"inside95", f.inside},
               {"rms_error", f.rms_error},
               {"rms_predicted", f.rms_predicted},
               {"verdict", drills::verdict_text(nees_verdict(f))},
               {"nees_by_run", Json::array()}};
    for (const ConsistencyRun& run : block.runs) {
      const std::optional<PartError>& e = run.at[k][static_cast<std::size_t>(part)];
      at["nees_by_run"].push_back(e ? Json(e->nees) : Json(nullptr));
    }
    j["at"].push_back(std::move(at));
  }
  const PartMetrics all = metrics_of_all(block, part);
  j["inside95"] = all.inside;
  j["inside95_verdict"] = drills::verdict_text(inside_verdict(all, block.runs.size()));
  return j;
}

Json block_json(const ConsistencyPlan& plan, const ConsistencyBlock& block) {
  Json j = {{"scenario", scenario_name(block.scenario)},
            {"ins", block.ins},
            {"verdict", drills::verdict_text(verdict_of(plan, block))}};
  if (!block.was_run()) {
    j["error"] = block.error;
    return j;
  }
  j["seeds"] = Json::array();
  for (const ConsistencyRun& run : block.runs) j["seeds"].push_back(run.seed);
  for (const StatePart part : kStateParts) {
    j[std::string(part_name(part))] = part_json(plan, block, part);
  }
  j["nis"] = Json::object();
  for (const auto& [source, sums] : pooled_innovations(block)) {
    j["nis"][source] = {{"measurements", sums.count},
                        {"rejected_by_gate", sums.refused},
                        {"per_dof", sums.mean_nis_per_dof()},
                        {"lag1", drills::number_or_null(sums.lag1())},
                        {"verdict", drills::verdict_text(nis_verdict(sums))}};
  }
  const ProtectionMetrics p = protection(block);
  j["protection"] = {{"samples", p.samples},
                     {"within_horizontal", p.within_horizontal},
                     {"within_vertical", p.within_vertical},
                     {"missed_alerts", p.missed_alerts},
                     {"false_alerts_per_h", p.false_alerts_per_h}};
  return j;
}

}  // namespace

bool ConsistencyReport::passed() const {
  return std::none_of(blocks.begin(), blocks.end(), [this](const ConsistencyBlock& block) {
    return verdict_of(plan, block) == drills::Verdict::kFail;
  });
}

std::string limits_text() {
  return fmt::format(
      "Limits: mean NEES per degree of freedom {:g} to {:g}; share of true states inside the 95 %\n"
      "ellipsoid {:.0f} to {:.0f} %; mean NIS per degree of freedom before gating {:g} to {:g}.",
      kNeesLimit.low, kNeesLimit.high, 100.0 * kInsideLimit.low, 100.0 * kInsideLimit.high,
      kNisLimit.low, kNisLimit.high);
}

std::string scenario_name(const std::string& path) {
  return std::filesystem::path(path).stem().string();
}

std::string moment_text(const ConsistencyPlan& plan, double t_s) {
  const std::optional<double> into_s = plan.into_outage_s(t_s);
  return into_s ? fmt::format("{:g} s without", *into_s) : fmt::format("{:g} s, GPS", t_s);
}

Json to_json(const ConsistencyReport& report) {
  Json j = {{"passed", report.passed()},
            {"outage_begin_s", report.plan.outage_begin_s},
            {"limits",
             {{"nees_per_dof", interval_json(kNeesLimit)},
              {"inside95", interval_json(kInsideLimit)},
              {"nis_per_dof", interval_json(kNisLimit)}}},
            {"blocks", Json::array()}};
  for (const ConsistencyBlock& block : report.blocks) {
    j["blocks"].push_back(block_json(report.plan, block));
  }
  return j;
}

report::Table nees_table(const ConsistencyReport& report) {
  report::Table t{{"NEES/dof", "INS", ""}, {}};
  for (const double t_s : report.plan.times_s) t.header.push_back(moment_text(report.plan, t_s));
  t.header.emplace_back("inside 95 % [%]");
  for (const ConsistencyBlock& block : report.blocks) {
    if (!block.was_run()) continue;
    for (const StatePart part : kStateParts) {
      std::vector<std::string> row = row_head(block, part);
      for (std::size_t k = 0; k < report.plan.times_s.size(); ++k) {
        const PartMetrics f = metrics_at(block, k, part);
        row.push_back(drills::marked(nees_text(f), nees_verdict(f)));
      }
      const PartMetrics all = metrics_of_all(block, part);
      row.push_back(drills::marked(fmt::format("{:.0f}", 100.0 * all.inside),
                                   inside_verdict(all, block.runs.size())));
      t.rows.push_back(std::move(row));
    }
  }
  t.note =
      "NEES/dof: squared error over its predicted variance, per degree of freedom; N s without: N "
      "s into the GPS outage; !: limit violated; ?: inconclusive with so few drives";
  return t;
}

report::Table error_table(const ConsistencyReport& report) {
  report::Table t{{"RMS error / predicted", "INS", ""}, {}};
  for (const double t_s : report.plan.times_s) t.header.push_back(moment_text(report.plan, t_s));
  for (const ConsistencyBlock& block : report.blocks) {
    if (!block.was_run()) continue;
    for (const StatePart part : kStateParts) {
      const bool angle = part == StatePart::kAttitude;
      const double scale = angle ? degrees(1.0) : 1.0;
      std::vector<std::string> row = row_head(block, part);
      row.back() += part == StatePart::kPosition ? " [m]" : angle ? " [deg]" : " [m/s]";
      for (std::size_t k = 0; k < report.plan.times_s.size(); ++k) {
        const PartMetrics f = metrics_at(block, k, part);
        row.push_back(fmt::format("{:.3f} / {:.3f}", scale * f.rms_error, scale * f.rms_predicted));
      }
      t.rows.push_back(std::move(row));
    }
  }
  return t;
}

report::Table protection_table(const ConsistencyReport& report) {
  report::Table t{{"without GPS", "INS", "within protection level, horizontal [%]", "vertical [%]",
                   "missed alerts", "false alerts with GPS [1/h]"},
                  {}};
  for (const ConsistencyBlock& block : report.blocks) {
    if (!block.was_run()) continue;
    const ProtectionMetrics p = protection(block);
    t.rows.push_back({scenario_name(block.scenario), block.ins,
                      fmt::format("{:.2f}", 100.0 * p.within_horizontal),
                      fmt::format("{:.2f}", 100.0 * p.within_vertical),
                      std::to_string(p.missed_alerts),
                      fmt::format("{:.1f}", p.false_alerts_per_h)});
  }
  return t;
}

report::Table nis_table(const ConsistencyReport& report) {
  report::Table t{{"mean NIS; correlation", "INS"}, {}};
  const std::set<std::string> sources = sources_of(report);
  for (const std::string& source : sources) t.header.push_back(source);
  for (const ConsistencyBlock& block : report.blocks) {
    if (!block.was_run()) continue;
    const Innovations pooled = pooled_innovations(block);
    std::vector<std::string> row = {scenario_name(block.scenario), block.ins};
    for (const std::string& source : sources) {
      const auto found = pooled.find(source);
      if (found == pooled.end()) {
        row.emplace_back("-");
        continue;
      }
      const std::optional<double> lag1 = found->second.lag1();
      row.push_back(drills::marked(fmt::format("{:.2f}; {}", found->second.mean_nis_per_dof(),
                                               lag1 ? fmt::format("{:.2f}", *lag1) : "-"),
                                   nis_verdict(found->second)));
    }
    t.rows.push_back(std::move(row));
  }
  t.note =
      "mean NIS per degree of freedom; autocorrelation of successive innovations, 0 if white; !: "
      "limit violated";
  return t;
}

}  // namespace rcs::studies

#include "tools/drills/drill_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/report/svg_plot.h"

namespace rcs::drills {
namespace {

using Json = nlohmann::ordered_json;

/// Three significant digits, and at most three decimals.
std::string metric_text(double v) {
  if (!std::isfinite(v)) return "-";
  if (v == std::round(v) && std::abs(v) < 1e6) return fmt::format("{:.0f}", v);
  const double a = std::abs(v);
  return fmt::format("{:.{}f}", v, a >= 100.0 ? 0 : a >= 10.0 ? 1 : a >= 1.0 ? 2 : 3);
}

std::string_view unit_of(const LimitKind& kind) {
  return kind.key == "within_protection" ? "%" : kind.unit;
}

/// The value without its unit.
std::string number_text(const LimitKind& kind, double v) {
  // A share of the time near 1 needs more digits.
  return kind.key == "within_protection" ? fmt::format("{:.2f}", 100.0 * v) : metric_text(v);
}

std::string with_unit(const LimitKind& kind, double v) {
  const std::string_view unit = unit_of(kind);
  return number_text(kind, v) + (unit.empty() ? "" : " ") + std::string(unit);
}

std::string value_text(const LimitResult& m) {
  return m.value ? with_unit(*m.kind, *m.value) : m.note;
}

std::string limit_text(const LimitKind& kind, const std::string& limit) {
  return (kind.at_least ? ">= " : "<= ") + limit;
}

/// The title of a column of metrics, with the limit if it is the same for all drills.
std::string column_title(const LimitKind& kind, const std::vector<DrillResult>& results) {
  std::string title(kind.title);
  if (!unit_of(kind).empty()) title += fmt::format(" [{}]", unit_of(kind));
  std::optional<double> limit;
  for (const DrillResult& r : results) {
    const auto found = r.drill.limits.find(kind.key);
    if (found == r.drill.limits.end()) continue;
    if (limit && *limit != found->second) return title;
    limit = found->second;
  }
  return limit ? title + " " + limit_text(kind, number_text(kind, *limit)) : title;
}

Json baselines_json(const Baselines& sums) {
  Json j = Json::object();
  for (std::size_t k = 0; k < sums.size(); ++k) {
    if (sums[k].samples == 0) continue;
    j[std::string(subfilter_name(static_cast<int>(k)))] = {
        {"samples", sums[k].samples},
        {"fused_rms_m", sums[k].fused_rms_m()},
        {"baseline_rms_m", sums[k].baseline_rms_m()},
        {"ratio", sums[k].ratio()}};
  }
  return j;
}

Json integrity_json(const std::optional<IntegrityMetrics>& f) {
  if (!f) return "not published";
  return {{"samples", f->samples},
          {"within_protection_horizontal", f->within_horizontal},
          {"within_protection_vertical", f->within_vertical},
          {"missed_alerts", f->missed_alerts},
          {"false_alerts_per_h", f->false_alerts_per_h},
          {"time_to_alert_s", number_or_null(f->time_to_alert_s)}};
}

Json run_json(const DrillRunMetrics& r) {
  Json j = {{"seed", r.seed},
            {"simulated_s", r.simulated_s},
            {"cep50_m", r.accuracy.cep50_m},
            {"cep95_m", r.accuracy.cep95_m},
            {"vertical95_m", r.accuracy.vertical95_m},
            {"horizontal_max_m", r.accuracy.horizontal_max_m},
            {"along_rms_m", r.accuracy.along_rms_m},
            {"across_rms_m", r.accuracy.across_rms_m},
            {"nees_per_dof", r.accuracy.nees_per_dof},
            {"samples", r.accuracy.samples},
            {"smooth_step_m", r.smooth.m},
            {"smooth_step_at_s", r.smooth.t_s},
            {"outages", Json::array()},
            {"returns", Json::array()},
            {"false_acceptances", Json::array()},
            {"nis", Json::object()},
            {"integrity", integrity_json(r.integrity)},
            {"subfilters", r.subfilters_published ? "published" : "not published"},
            {"baselines", baselines_json(r.baselines)},
            {"registrations", r.stops},
            {"overruns", r.overruns},
            {"missed_cycles", r.missed},
            {"hash", fmt::format("{:016x}", r.hash)}};
  for (const OutageDrift& o : r.outages) {
    j["outages"].push_back({{"begin_s", o.window.begin_s},
                            {"end_s", o.window.end_s},
                            {"driven_m", o.driven_m},
                            {"horizontal_at_start_m", o.start_m},
                            {"horizontal_at_end_m", o.end_m},
                            {"heading_at_start_deg", degrees(o.heading_start_rad)},
                            {"drift_pct", o.drift_pct},
                            {"drift_m_per_min", o.m_per_min}});
  }
  for (const GpsReturn& g : r.returns) {
    j["returns"].push_back(
        {{"clean_s", g.clean_s}, {"accepted_after_s", number_or_null(g.accepted_after_s)}});
  }
  for (const FalseAcceptance& f : r.false_acceptances) {
    j["false_acceptances"].push_back(
        {{"t_s", f.t_s}, {"error_m", f.error_m}, {"sigmas", f.sigmas}});
  }
  for (const auto& [name, f] : r.nis) {
    j["nis"][name] = {
        {"considered", f.considered}, {"accepted", f.accepted}, {"per_dof", f.per_dof}};
  }
  return j;
}

std::string junit_case(const DrillResult& r, std::string_view name, std::string_view inner) {
  return fmt::format("    <testcase classname=\"drill.{}\" name=\"{}\">{}</testcase>\n",
                     report::escape_xml(r.drill.id), report::escape_xml(name), inner);
}

std::string junit_suite(const DrillResult& r) {
  std::string cases;
  int tests = 0;
  int failures = 0;
  int skipped = 0;
  const auto add = [&](std::string_view name, Verdict verdict, const std::string& message) {
    ++tests;
    std::string inner;
    if (verdict == Verdict::kFail) {
      ++failures;
      inner = fmt::format("<failure message=\"{}\"/>", report::escape_xml(message));
    }
    if (verdict == Verdict::kInconclusive) {
      ++skipped;
      inner = fmt::format("<skipped message=\"{}\"/>", report::escape_xml(message));
    }
    cases += junit_case(r, name, inner);
  };
  if (!r.error.empty()) add("run", Verdict::kFail, r.error);
  if (!r.skipped.empty()) add("run", Verdict::kInconclusive, r.skipped);
  for (const LimitResult& m : r.limits) {
    add(m.kind->key, m.verdict,
        fmt::format("{} (limit {}){}{}", value_text(m),
                    limit_text(*m.kind, with_unit(*m.kind, m.limit)),
                    m.value && !m.note.empty() ? ": " : "", m.value ? m.note : ""));
  }
  return fmt::format(
      "  <testsuite name=\"{}\" tests=\"{}\" failures=\"{}\" skipped=\"{}\">\n{}  </testsuite>\n",
      report::escape_xml(r.drill.id), tests, failures, skipped, cases);
}

}  // namespace

std::string_view verdict_text(Verdict verdict) {
  return verdict == Verdict::kPass ? "pass" : verdict == Verdict::kFail ? "FAIL" : "inconclusive";
}

std::string verdict_text(const DrillResult& r) {
  if (!r.error.empty()) return "error";
  if (!r.skipped.empty()) return "not run";
  return std::string(verdict_text(r.verdict()));
}

std::string marked(const std::string& metric, Verdict verdict) {
  return metric + (verdict == Verdict::kFail           ? " !"
                   : verdict == Verdict::kInconclusive ? " ?"
                                                       : "");
}

Json number_or_null(const std::optional<double>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json to_json(const std::vector<DrillResult>& results) {
  Json j = {{"drills", Json::array()}};
  for (const DrillResult& r : results) {
    Json drill = {{"id", r.drill.id},
                  {"name", r.drill.name},
                  {"verdict", verdict_text(r)},
                  {"stimuli", Json::array()},
                  {"limits", Json::array()}};
    if (!r.error.empty()) drill["error"] = r.error;
    if (!r.skipped.empty()) drill["skipped"] = r.skipped;
    for (const Stimulus& s : r.drill.stimuli) {
      drill["stimuli"].push_back(
          {{"what", describe(s)}, {"begin_s", s.begin_s}, {"length_s", s.length_s}});
    }
    for (const LimitResult& m : r.limits) {
      drill["limits"].push_back({{"key", m.kind->key},
                                 {"limit", m.limit},
                                 {"value", number_or_null(m.value)},
                                 {"verdict", verdict_text(m.verdict)},
                                 {"note", m.note}});
    }
    drill["baselines"] = baselines_json(pooled_baselines(r.runs));
    drill["runs"] = Json::array();
    for (const DrillRunMetrics& run : r.runs) drill["runs"].push_back(run_json(run));
    j["drills"].push_back(std::move(drill));
  }
  return j;
}

std::string to_junit(const std::vector<DrillResult>& results) {
  std::string suites;
  for (const DrillResult& r : results) suites += junit_suite(r);
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuites name=\"rcs drill\">\n" + suites +
         "</testsuites>\n";
}

report::Table drill_table(const std::vector<DrillResult>& results) {
  report::Table t{{"drill", "result", "seeds"}, {}};
  std::vector<const LimitKind*> columns;
  for (const LimitKind& kind : kLimits) {
    const bool used = std::any_of(results.begin(), results.end(), [&](const DrillResult& r) {
      return r.drill.limits.count(kind.key) > 0;
    });
    // A limit that failed a drill is the reason that is looked for.
    const bool failed = std::any_of(results.begin(), results.end(), [&](const DrillResult& r) {
      return std::any_of(r.limits.begin(), r.limits.end(), [&](const LimitResult& m) {
        return m.kind == &kind && m.verdict == Verdict::kFail;
      });
    });
    if (!used || !(kind.overview || failed)) continue;
    columns.push_back(&kind);
    t.header.push_back(column_title(kind, results));
  }
  for (const DrillResult& r : results) {
    std::vector<std::string> row = {r.drill.name, verdict_text(r), std::to_string(r.runs.size())};
    for (const LimitKind* kind : columns) {
      const auto found = std::find_if(r.limits.begin(), r.limits.end(),
                                      [&](const LimitResult& m) { return m.kind == kind; });
      if (found == r.limits.end()) {
        row.emplace_back("");
        continue;
      }
      row.push_back(
          marked(found->value ? number_text(*kind, *found->value) : found->note, found->verdict));
    }
    t.rows.push_back(std::move(row));
  }
  t.note =
      "over all seeds, as the limit is defined; !: beyond the limit; ?: inconclusive with so few "
      "seeds; "
      "an empty cell: the drill has no such limit";
  return t;
}

report::Table limit_table(const DrillResult& result) {
  report::Table t{{"metric", "result", "value", "limit", ""}, {}};
  for (const LimitResult& m : result.limits) {
    t.rows.push_back({fmt::format("{}: {}", m.kind->title, m.kind->meaning),
                      std::string(verdict_text(m.verdict)), value_text(m),
                      limit_text(*m.kind, with_unit(*m.kind, m.limit)), m.value ? m.note : ""});
  }
  return t;
}

report::Table run_table(const DrillResult& result) {
  report::Table t{{"seed", "CEP50 [m]", "CEP95 [m]", "vertical 95 % [m]", "max [m]", "along [m]",
                   "across [m]", "drift [%]", "[m/min]", "heading [deg]", "NEES/dof", "step [m]"},
                  {}};
  for (const DrillRunMetrics& r : result.runs) {
    const OutageDrift* last = r.outages.empty() ? nullptr : &r.outages.back();
    const auto of_outage = [&](double OutageDrift::*value, double scale) {
      return last == nullptr ? "-" : metric_text(scale * last->*value);
    };
    t.rows.push_back({std::to_string(r.seed), metric_text(r.accuracy.cep50_m),
                      metric_text(r.accuracy.cep95_m), metric_text(r.accuracy.vertical95_m),
                      metric_text(r.accuracy.horizontal_max_m), metric_text(r.accuracy.along_rms_m),
                      metric_text(r.accuracy.across_rms_m), of_outage(&OutageDrift::drift_pct, 1.0),
                      of_outage(&OutageDrift::m_per_min, 1.0),
                      of_outage(&OutageDrift::heading_start_rad, degrees(1.0)),
                      metric_text(r.accuracy.nees_per_dof), metric_text(r.smooth.m)});
  }
  return t;
}

}  // namespace rcs::drills

#include "tools/studies/outages_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tools/base/statistics.h"
#include "tools/drills/drill_output.h"

namespace rcs::studies {
namespace {

using Json = nlohmann::ordered_json;

constexpr auto kWm = static_cast<std::size_t>(PoseEstimator::kWm);

std::string name_of(std::size_t estimator) {
  return std::string(estimator_name(static_cast<PoseEstimator>(estimator)));
}

std::string median_and_worst(const std::vector<double>& values) {
  if (values.empty()) return "-";
  const tools::Summary s = tools::summarize(values);
  return fmt::format("{:.2f}/{:.2f}", s.p50, s.max);
}

std::optional<double> horizontal(const OutageFinding& f, std::size_t estimator) {
  const std::optional<OutageError>& e = f.at_end[estimator];
  return e ? std::optional<double>(e->horizontal_m) : std::nullopt;
}

/// Outages of one length in one variant.
using Group = std::vector<const OutageFinding*>;

template <class Value>
std::vector<double> values_of(const Group& group, Value value) {
  std::vector<double> values;
  for (const OutageFinding* f : group) {
    if (const std::optional<double> v = value(*f)) values.push_back(*v);
  }
  return values;
}

std::vector<Group> grouped(const OutageReport& report) {
  std::vector<Group> groups;
  for (const OutageFinding& f : report.findings) {
    const auto same = std::find_if(groups.begin(), groups.end(), [&](const Group& g) {
      return g.front()->variant == f.variant &&
             std::abs(g.front()->window.length_s() - f.window.length_s()) < 1e-6;
    });
    if (same == groups.end()) {
      groups.push_back({&f});
    } else {
      same->push_back(&f);
    }
  }
  return groups;
}

std::vector<std::size_t> estimators_of(const OutageReport& report) {
  std::vector<std::size_t> estimators;
  for (std::size_t t = 0; t < kPoseEstimators; ++t) {
    const bool any = std::any_of(report.findings.begin(), report.findings.end(),
                                 [t](const OutageFinding& f) { return f.at_end[t].has_value(); });
    if (any) estimators.push_back(t);
  }
  return estimators;
}

std::size_t judged(const Group& group) {
  return static_cast<std::size_t>(std::count_if(
      group.begin(), group.end(), [](const OutageFinding* f) { return f->failed.empty(); }));
}

std::string back_text(const Group& group) {
  std::size_t never = 0;
  std::vector<double> after_s;
  for (const OutageFinding* f : group) {
    if (f->may_be_back && !f->back_after_s) ++never;
    if (f->back_after_s) after_s.push_back(*f->back_after_s);
  }
  const std::string text = median_and_worst(after_s);
  return never == 0 ? text : fmt::format("{}, {} not", text, never);
}

/// "30 s, without odometry"
std::string name_of(const OutageReport& report, const Group& g) {
  const std::string length = fmt::format("{:g} s", g.front()->window.length_s());
  return g.front()->variant == 0 ? length : length + ", " + report.variants[g.front()->variant];
}

std::string errors_of(const Group& g, std::size_t estimator) {
  return median_and_worst(
      values_of(g, [=](const OutageFinding& f) { return horizontal(f, estimator); }));
}

Json error_json(const std::optional<OutageError>& e) {
  if (!e) return nullptr;
  return {{"horizontal_m", e->horizontal_m},
          {"vertical_m", e->vertical_m},
          {"heading_deg", degrees(e->heading_rad)}};
}

Json summary_json(const std::vector<double>& values) {
  if (values.empty()) return nullptr;
  const tools::Summary s = tools::summarize(values);
  return {{"count", s.count}, {"median", s.p50}, {"worst", s.max}};
}

Json finding_json(const OutageReport& report, const OutageFinding& f) {
  Json j = {{"sources", report.variants[f.variant]},
            {"begin_s", f.window.begin_s},
            {"length_s", f.window.length_s()}};
  if (!f.failed.empty()) {
    j["failed"] = f.failed;
    return j;
  }
  j["driven_m"] = f.driven_m;
  j["at_begin"] = error_json(f.at_begin);
  for (std::size_t t = 0; t < kPoseEstimators; ++t) {
    if (f.at_end[t]) j["at_end"][name_of(t)] = error_json(f.at_end[t]);
  }
  j["sigma_m"] = f.sigma_m;
  j["to_next_fix_m"] = drills::number_or_null(f.to_fix_m);
  j["next_fix_sigma_m"] = drills::number_or_null(f.fix_sigma_m);
  j["gps_accepted_after_s"] = drills::number_or_null(f.back_after_s);
  if (f.at_log_end) j["at_log_end"] = error_json(f.at_log_end);
  return j;
}

}  // namespace

report::Table outage_table(const OutageReport& report) {
  report::Table t{{"outage", "outages", "driven [m]", "WM [m]", "sigma of WM [m]",
                   "to next fix [m]", "GPS back [s]"},
                  {}};
  for (const Group& g : grouped(report)) {
    const std::vector<double> driven_m = values_of(g, [](const OutageFinding& f) {
      return f.failed.empty() ? std::optional<double>(f.driven_m) : std::nullopt;
    });
    std::vector<std::string> row = {
        name_of(report, g),
        judged(g) == g.size() ? fmt::format("{}", g.size())
                              : fmt::format("{} of {}", judged(g), g.size()),
        driven_m.empty() ? "-" : fmt::format("{:.0f}", tools::summarize(driven_m).p50)};
    row.push_back(errors_of(g, kWm));
    row.push_back(median_and_worst(values_of(g, [](const OutageFinding& f) {
      return f.failed.empty() ? std::optional<double>(f.sigma_m) : std::nullopt;
    })));
    row.push_back(
        median_and_worst(values_of(g, [](const OutageFinding& f) { return f.to_fix_m; })));
    row.push_back(back_text(g));
    t.rows.push_back(std::move(row));
  }
  t.note =
      "a/b: median/maximum over the outages of a length; driven: median; to next fix: distance "
      "of WM from the first fix after the outage; GPS back: from that fix until WM accepts GPS";
  return t;
}

report::Table dead_reckoning_table(const OutageReport& report) {
  report::Table t{{"other estimates [m]"}, {}};
  std::vector<std::size_t> estimators = estimators_of(report);
  estimators.erase(std::remove(estimators.begin(), estimators.end(), kWm), estimators.end());
  for (const std::size_t k : estimators) t.header.push_back(name_of(k));
  for (const Group& g : grouped(report)) {
    std::vector<std::string> row = {name_of(report, g)};
    for (const std::size_t k : estimators) row.push_back(errors_of(g, k));
    t.rows.push_back(std::move(row));
  }
  return t;
}

report::Table cut_table(const OutageReport& report) {
  report::Table t{{"estimator", "error at the end [m]", "up [m]", "heading [deg]",
                   "at the end of the log [m]", "start to end [m]"},
                  {}};
  for (std::size_t i = 0; i < report.findings.size(); ++i) {
    const OutageFinding& f = report.findings[i];
    for (std::size_t k = 0; k < kPoseEstimators; ++k) {
      const std::optional<OutageError>& e = f.at_end[k];
      const std::optional<double> closed_m =
          i < report.closures.size() ? report.closures[i].m[k] : std::nullopt;
      if (!e && !closed_m) continue;
      std::string name = name_of(k);
      if (f.variant > 0) name += ", " + report.variants[f.variant];
      const bool at_log_end = k == 0 && f.at_log_end;
      t.rows.push_back({name, e ? fmt::format("{:.2f}", e->horizontal_m) : "-",
                        e ? fmt::format("{:.2f}", e->vertical_m) : "-",
                        e ? fmt::format("{:.2f}", degrees(e->heading_rad)) : "-",
                        at_log_end ? fmt::format("{:.2f}", f.at_log_end->horizontal_m) : "-",
                        closed_m ? fmt::format("{:.2f}", *closed_m) : "-"});
    }
    const bool fixes = i < report.closures.size() && report.closures[i].fixes_m;
    if (f.variant == 0 && fixes) {
      t.rows.push_back(
          {"the fixes", "-", "-", "-", "-", fmt::format("{:.2f}", *report.closures[i].fixes_m)});
    }
  }
  t.note = "up: vertical error; start to end: distance of the last from the first pose; -: none";
  return t;
}

Json to_json(const OutageReport& report) {
  Json j = {{"reference", report.reference},
            {"gps_accepted_share", report.with_gps.accepted_share},
            {"groups", Json::array()},
            {"outages", Json::array()}};
  for (const Group& g : grouped(report)) {
    Json group = {{"sources", report.variants[g.front()->variant]},
                  {"length_s", g.front()->window.length_s()},
                  {"outages", g.size()},
                  {"evaluated", judged(g)}};
    for (std::size_t k = 0; k < kPoseEstimators; ++k) {
      const std::vector<double> values =
          values_of(g, [k](const OutageFinding& f) { return horizontal(f, k); });
      if (!values.empty()) group["horizontal_m"][name_of(k)] = summary_json(values);
    }
    group["to_next_fix_m"] =
        summary_json(values_of(g, [](const OutageFinding& f) { return f.to_fix_m; }));
    group["gps_accepted_after_s"] =
        summary_json(values_of(g, [](const OutageFinding& f) { return f.back_after_s; }));
    j["groups"].push_back(std::move(group));
  }
  for (const OutageFinding& f : report.findings) j["outages"].push_back(finding_json(report, f));
  for (const ClosureFinding& c : report.closures) {
    Json closure = {{"sources", report.variants[c.variant]},
                    {"fixes_m", drills::number_or_null(c.fixes_m)}};
    for (std::size_t k = 0; k < kPoseEstimators; ++k) {
      if (c.m[k]) closure["start_to_end_m"][name_of(k)] = *c.m[k];
    }
    j["closures"].push_back(std::move(closure));
  }
  for (const drills::DrillEvent& event : report.with_gps.warnings) {
    j["warnings_with_gps"].push_back(
        {{"node", event.node}, {"code", event.code}, {"text", event.text}});
  }
  return j;
}

}  // namespace rcs::studies

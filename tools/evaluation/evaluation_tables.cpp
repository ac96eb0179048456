#include "tools/evaluation/evaluation_tables.h"

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace rcs::evaluation {
namespace {

using report::fixed;

constexpr std::pair<std::string_view, std::string_view> kStopMeanings[] = {
    {"converged", "the pose no longer changes"},
    {"max iterations", "best pose after the permitted iterations"},
    {"budget", "best pose within the computing time"},
    {"limit cycle", "the iterations alternate between poses"},
    {"too few", "too few pairs of points, no pose"},
    {"degenerate", "converged, but a direction has no information"},
    {"empty", "no points, or nothing to match them to"},
    {"diverged", "too far from the prediction, no pose"},
    {"seeded", "the scan began a new rolling map"},
    {"held", "left out to meet a deadline"}};

Json to_json(const tools::Summary& s, double scale) {
  return {{"mean", s.mean * scale}, {"rms", s.rms * scale}, {"p50", s.p50 * scale},
          {"p95", s.p95 * scale},   {"p99", s.p99 * scale}, {"max", s.max * scale}};
}

Json to_json(const AbsoluteError& e) {
  return {{"translation_m", to_json(e.translation_m, 1.0)},
          {"horizontal_m", to_json(e.horizontal_m, 1.0)},
          {"vertical_m", to_json(e.vertical_m, 1.0)},
          {"rotation_deg", to_json(e.rotation_rad, degrees(1.0))}};
}

Json to_json(const RelativeError& e) {
  Json out;
  if (e.length_m > 0.0) out["length_m"] = e.length_m;
  if (e.frames > 0) out["frames"] = e.frames;
  out["segments"] = e.segments;
  out["driven_m"] = e.driven_m;
  out["translation_m"] = e.translation_m;
  out["translation_percent"] = e.translation_percent;
  out["rotation_deg"] = degrees(e.rotation_rad);
  out["rotation_deg_per_m"] = degrees(e.rotation_rad_per_m);
  return out;
}

std::vector<std::string> row(const std::string& name, const tools::Summary& s, double scale,
                             int digits) {
  return {name, fixed(s.rms * scale, digits), fixed(s.p50 * scale, digits),
          fixed(s.p95 * scale, digits), fixed(s.max * scale, digits)};
}

std::string percent(double share) { return fixed(100.0 * share, 1) + " %"; }

}  // namespace

Json to_json(const RunMetrics& f) {
  Json out = {{"scans", f.scans},
              {"scans_missing", f.scans_missing},
              {"stops", f.stops},
              {"iterations_p50", f.iterations.p50},
              {"prior_map_matches", f.prior_matches}};
  for (const auto& [name, node] : f.nodes) {
    Json n = {{"cycles", node.wall_ms.count},
              {"wall_ms", to_json(node.wall_ms, 1.0)},
              {"late_ms", to_json(node.late_ms, 1.0)},
              {"missed", node.missed},
              {"overruns", node.overruns}};
    for (const auto& [stage, ms] : node.stages_ms) n["stages_ms"][stage] = to_json(ms, 1.0);
    for (const auto& [channel, lost] : node.lost) n["lost"][channel] = lost;
    out["nodes"][name] = n;
  }
  if (f.chain_ms) out["last_facet_to_nav_state_ms"] = to_json(*f.chain_ms, 1.0);
  return out;
}

Json to_json(const TrajectoryMetrics& f) {
  Json out = {{"pairs", f.pairs},
              {"driven_m", f.driven_m},
              {"drift_percent", f.drift_percent},
              {"ate_rigid", to_json(f.rigid)},
              {"ate_yaw", to_json(f.yaw)},
              {"ate_unaligned", to_json(f.unaligned)},
              {"rpe_10_frames", to_json(f.per_10_frames)},
              {"rpe_mean_percent", f.lengths_mean.translation_percent},
              {"rpe_mean_deg_per_m", degrees(f.lengths_mean.rotation_rad_per_m)},
              {"rpe", Json::array()}};
  for (const RelativeError& e : f.per_length) out["rpe"].push_back(to_json(e));
  return out;
}

Json to_json(const WorldMetrics& f) {
  return {{"samples", f.errors.size()},
          {"horizontal_m", to_json(f.horizontal_m, 1.0)},
          {"vertical_m", to_json(f.vertical_m, 1.0)},
          {"heading_deg", to_json(f.heading_rad, degrees(1.0))},
          {"nees_per_dof", f.nees_per_dof},
          {"nees_samples", f.nees_samples},
          {"covariances_not_positive_definite", f.not_positive_definite},
          {"horizontal_within_3_sigma", f.horizontal_within_3_sigma},
          {"vertical_within_3_sigma", f.vertical_within_3_sigma},
          {"heading_within_3_sigma", f.heading_within_3_sigma}};
}

Json to_json(const OutageMetrics& f, Stamp zero) {
  return {{"from_s", seconds(f.interval.from - zero)},
          {"to_s", seconds(f.interval.to - zero)},
          {"driven_m", f.driven_m},
          {"start_horizontal_m", f.start_horizontal_m},
          {"horizontal_m", to_json(f.horizontal_m, 1.0)},
          {"end_horizontal_m", f.end_horizontal_m},
          {"drift_percent", f.drift_percent},
          {"nees_per_dof", f.nees_per_dof}};
}

report::Table scan_table(const RunMetrics& f) {
  if (f.stops.empty() && f.scans_missing == 0 && f.prior_matches == 0) {
    return {{"no registrations: the log has no scans that SP processed"}, {}};
  }
  report::Table t{{"registrations to the rolling map", "scans"}, {}};
  for (const auto& [stop, count] : f.stops) t.rows.push_back({stop, std::to_string(count)});
  t.rows.push_back({"scans missing by number", std::to_string(f.scans_missing)});
  t.rows.push_back({"matches to the a priori map", std::to_string(f.prior_matches)});
  t.note = "reason for which the registration of a scan ended";
  for (const auto& [stop, meaning] : kStopMeanings) {
    if (f.stops.count(std::string(stop)) > 0) t.note += fmt::format("; {}: {}", stop, meaning);
  }
  return t;
}

report::Table latency_table(const RunMetrics& f) {
  report::Table t{{"wall time [ms]", "cycles", "p50", "p99", "max", "overruns"}, {}};
  const auto add = [&t](const std::string& name, const tools::Summary& s,
                        const std::string& overruns) {
    t.rows.push_back({name, std::to_string(s.count), fixed(s.p50, 2), fixed(s.p99, 2),
                      fixed(s.max, 2), overruns});
  };
  for (const auto& [name, node] : f.nodes) {
    add(name, node.wall_ms, std::to_string(node.overruns));
    for (const auto& [stage, ms] : node.stages_ms) add(fmt::format("{}: {}", name, stage), ms, "");
  }
  if (f.chain_ms) add("last facet to nav_state", *f.chain_ms, "");
  t.note =
      "per cycle (sp: scan); p50, p99: percentiles; NODE: STAGE is a part of the time of NODE; "
      "overruns: cycles that ended after their deadline";
  return t;
}

report::Table absolute_table(const TrajectoryMetrics& f) {
  report::Table t{{"absolute error", "rms", "p50", "p95", "max"}, {}};
  t.rows.push_back(row("position, aligned over SE(3) [m]", f.rigid.translation_m, 1.0, 3));
  t.rows.push_back(row("position, aligned over position and yaw [m]", f.yaw.translation_m, 1.0, 3));
  t.rows.push_back(
      row("rotation, aligned over position and yaw [deg]", f.yaw.rotation_rad, degrees(1.0), 3));
  t.rows.push_back(row("position, not aligned [m]", f.unaligned.translation_m, 1.0, 3));
  t.note =
      "against the given true poses; rms: root mean square; p50, p95: percentiles; aligned: after "
      "the rigid motion that fits the estimate best to the truth, which gives the absolute "
      "trajectory error (ATE)";
  return t;
}

report::Table relative_table(const TrajectoryMetrics& f) {
  report::Table t{{"relative error over", "segments", "m", "% of distance", "deg", "deg/m"}, {}};
  const auto add = [&t](const std::string& name, const RelativeError& e) {
    t.rows.push_back({name, std::to_string(e.segments), fixed(e.translation_m, 3),
                      fixed(e.translation_percent, 2), fixed(degrees(e.rotation_rad), 3),
                      fixed(degrees(e.rotation_rad_per_m), 4)});
  };
  add("10 scans", f.per_10_frames);
  for (const RelativeError& e : f.per_length) add(fmt::format("{:g} m", e.length_m), e);
  t.note =
      "relative pose error (RPE): error of the estimated motion over a segment against the true "
      "one, mean over all segments; m and deg: at the end of a segment";
  return t;
}

report::Table world_table(const WorldMetrics& f) {
  report::Table t{{"error of the world pose", "rms", "p50", "p95", "max", "within 3 sigma"}, {}};
  const auto add = [&t](std::vector<std::string> cells, double within) {
    cells.push_back(percent(within));
    t.rows.push_back(std::move(cells));
  };
  add(row("horizontal [m]", f.horizontal_m, 1.0, 3), f.horizontal_within_3_sigma);
  add(row("vertical [m]", f.vertical_m, 1.0, 3), f.vertical_within_3_sigma);
  add(row("heading [deg]", f.heading_rad, degrees(1.0), 3), f.heading_within_3_sigma);
  t.note =
      "against the ground truth (SIM_TRUTH), not aligned; rms: root mean square; p50, p95: "
      "percentiles; within 3 sigma: share of the errors within three of the standard deviations "
      "that WM published";
  return t;
}

report::Table outage_table(const std::vector<OutageMetrics>& outages, Stamp zero) {
  report::Table t{{"GPS denied", "driven [m]", "error at its start [m]", "rms [m]", "95 % [m]",
                   "max [m]", "at its end [m]", "drift", "NEES/dof"},
                  {}};
  for (const OutageMetrics& o : outages) {
    t.rows.push_back({fmt::format("{:.1f} s to {:.1f} s", seconds(o.interval.from - zero),
                                  seconds(o.interval.to - zero)),
                      fixed(o.driven_m, 1), fixed(o.start_horizontal_m, 2),
                      fixed(o.horizontal_m.rms, 2), fixed(o.horizontal_m.p95, 2),
                      fixed(o.horizontal_m.max, 2), fixed(o.end_horizontal_m, 2),
                      fixed(o.drift_percent, 2) + " %", fixed(o.nees_per_dof, 2)});
  }
  t.note =
      "errors are horizontal, against the ground truth (SIM_TRUTH); drift: error at the end in "
      "percent of the distance driven in the outage; NEES/dof: squared error normalized by the "
      "published covariance, per degree of freedom: 1 if consistent, more if overconfident";
  return t;
}

}  // namespace rcs::evaluation

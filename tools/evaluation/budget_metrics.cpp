#include "tools/evaluation/budget_metrics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>

#include "rcs/node/params/vehicle_tables.h"
#include "tools/base/statistics.h"

namespace rcs::evaluation {
namespace {

struct Tail {
  std::size_t count = 0;
  double p50 = 0.0;
  double p99 = 0.0;
  double p999 = 0.0;
  double max = 0.0;
};

Tail tail_of(std::vector<double> values) {
  Tail t;
  t.count = values.size();
  if (values.empty()) return t;
  std::sort(values.begin(), values.end());
  t.p50 = tools::percentile(values, 0.50);
  t.p99 = tools::percentile(values, 0.99);
  t.p999 = tools::percentile(values, 0.999);
  t.max = values.back();
  return t;
}

double share_of(std::int64_t part, std::int64_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

void get(ParamTable* table, const std::string& key, std::optional<double>* value, Range range,
         std::string_view meaning) {
  double limit = std::numeric_limits<double>::quiet_NaN();  // none
  table->get(key, &limit, range, meaning);
  if (!std::isnan(limit)) *value = limit;
}

/// Descriptions of the limits of a chain for ParamTable::get().
struct ChainMeaning {
  std::string_view p50, p99, p999, max;
};

void get(ParamTable* table, const std::string& prefix, const ChainMeaning& meaning,
         ChainLimits* limits) {
  constexpr Range kMilliseconds{0.001, 1e6};
  get(table, prefix + "_p50_ms", &limits->p50_ms, kMilliseconds, meaning.p50);
  get(table, prefix + "_p99_ms", &limits->p99_ms, kMilliseconds, meaning.p99);
  get(table, prefix + "_p999_ms", &limits->p999_ms, kMilliseconds, meaning.p999);
  get(table, prefix + "_max_ms", &limits->max_ms, kMilliseconds, meaning.max);
}

void judge_chain(const std::string& prefix, const std::vector<double>& values,
                 const ChainLimits& limits, std::vector<BudgetVerdict>* verdicts) {
  const Tail tail = tail_of(values);
  const auto add = [&](const char* suffix, double value, const std::optional<double>& limit) {
    if (limit) verdicts->push_back({prefix + suffix, value, *limit, tail.count > 0});
  };
  add("_p50_ms", tail.p50, limits.p50_ms);
  add("_p99_ms", tail.p99, limits.p99_ms);
  add("_p999_ms", tail.p999, limits.p999_ms);
  add("_max_ms", tail.max, limits.max_ms);
}

report::Table tail_table(const std::string& what, const Samples& samples) {
  report::Table t{{what, "count", "p50", "p99", "p99.9", "max"}, {}};
  for (const auto& [name, values] : samples) {
    const Tail tail = tail_of(values);
    if (tail.count == 0) continue;
    t.rows.push_back({name, std::to_string(tail.count), fmt::format("{:.2f}", tail.p50),
                      fmt::format("{:.2f}", tail.p99), fmt::format("{:.2f}", tail.p999),
                      fmt::format("{:.2f}", tail.max)});
  }
  return t;
}

Json to_json(const Samples& samples) {
  Json out = Json::object();
  for (const auto& [name, values] : samples) {
    const Tail t = tail_of(values);
    if (t.count == 0) continue;
    out[name] = {{"count", t.count},
                 {"p50_ms", t.p50},
                 {"p99_ms", t.p99},
                 {"p999_ms", t.p999},
                 {"max_ms", t.max}};
  }
  return out;
}

/// Counts per bin as the outline of a histogram: two points per bin.
report::Series outline(const std::string& label, report::Colour colour, report::SeriesStyle style,
                       const std::vector<double>& values, double bin_ms, int bins) {
  std::vector<double> counts(static_cast<std::size_t>(bins), 0.0);
  for (const double v : values) {
    const double bin = std::clamp(std::floor(v / bin_ms), 0.0, bins - 1.0);
    counts[static_cast<std::size_t>(bin)] += 1.0;
  }
  report::Series s{label, colour, style, {}, {}, {}};
  for (int k = 0; k < bins; ++k) {
    // Log scale: an empty bin is drawn below one count.
    const double count = std::max(0.5, counts[static_cast<std::size_t>(k)]);
    s.x.insert(s.x.end(), {k * bin_ms, (k + 1) * bin_ms});
    s.y.insert(s.y.end(), {count, count});
  }
  return s;
}

}  // namespace

Result<BudgetLimits> read_budget_limits(const ParamFile& file) {
  BudgetLimits limits;
  ParamTable table = file.root().table("budget");
  constexpr ChainMeaning kNavState{
      "Limit of the median latency from the sending of a scan's last facet to the navigation state "
      "that uses the scan.",
      "Limit of the 99th percentile of the latency from the sending of a scan's last facet to the "
      "navigation state that uses the scan.",
      "Limit of the 99.9th percentile of the latency from the sending of a scan's last facet to "
      "the navigation state that uses the scan.",
      "Limit of the largest latency from the sending of a scan's last facet to the navigation "
      "state that uses the scan."};
  constexpr ChainMeaning kDrive{
      "Limit of the median latency from the sending of a scan's last facet to the drive command "
      "that uses the scan.",
      "Limit of the 99th percentile of the latency from the sending of a scan's last facet to the "
      "drive command that uses the scan.",
      "Limit of the 99.9th percentile of the latency from the sending of a scan's last facet to "
      "the drive command that uses the scan.",
      "Limit of the largest latency from the sending of a scan's last facet to the drive command "
      "that uses the scan."};
  get(&table, "facet_to_nav_state", kNavState, &limits.nav_state);
  get(&table, "facet_to_drive", kDrive, &limits.drive);
  table.get("unaccounted_scans", &limits.unaccounted_scans, {0, 1e9},
            "Limit of the number of scans whose outcome no message of SP accounts for.");
  get(&table, "degraded_share", &limits.degraded_share, {0, 1},
      "Limit of the share of the scans sent that are registered with reduced work.");
  get(&table, "held_share", &limits.held_share, {0, 1},
      "Limit of the share of the scans sent that are held: published without a registration to "
      "keep the deadline.");
  get(&table, "failed_share", &limits.failed_share, {0, 1},
      "Limit of the share of the scans sent whose registration fails.");
  get(&table, "dropped_share", &limits.dropped_share, {0, 1},
      "Limit of the share of the scans sent of which SP received no facet.");
  get(&table, "overrun_share", &limits.overrun_share, {0, 1},
      "Limit, for each node, of the share of its cycles (SP: scans) that end after their "
      "deadline.");
  if (const Outcome read = file.finish(tables_but({"budget"})); !read) return read.error();
  return limits;
}

std::vector<BudgetVerdict> judge(const BudgetRecord& record, const BudgetLimits& limits) {
  std::vector<BudgetVerdict> verdicts;
  judge_chain("facet_to_nav_state", values_of(record.hops, kToNavState), limits.nav_state,
              &verdicts);
  judge_chain("facet_to_drive", values_of(record.hops, kToDrive), limits.drive, &verdicts);
  const ScanCounts& s = record.scans;
  verdicts.push_back({"unaccounted_scans", static_cast<double>(s.unaccounted),
                      static_cast<double>(limits.unaccounted_scans), s.sent > 0});
  const auto add = [&](const char* name, std::int64_t part, const std::optional<double>& limit) {
    if (limit) verdicts.push_back({name, share_of(part, s.sent), *limit, s.sent > 0});
  };
  add("degraded_share", s.degraded, limits.degraded_share);
  add("held_share", s.held, limits.held_share);
  add("failed_share", s.failed, limits.failed_share);
  add("dropped_share", s.dropped, limits.dropped_share);
  if (limits.overrun_share) {
    for (const auto& [name, node] : record.nodes) {
      verdicts.push_back({fmt::format("overrun_share of {}", name), node.overrun_share(),
                          *limits.overrun_share, node.cycles > 0});
    }
  }
  return verdicts;
}

report::Table hop_table(const BudgetRecord& record) {
  report::Table t = tail_table("latency of a scan [ms]", record.hops);
  t.note =
      "count: scans that reached this hop; a node may begin a cycle before the message of the "
      "other is received, so that a hop can be negative";
  return t;
}

report::Table stage_table(const BudgetRecord& record) {
  return tail_table("wall time of a cycle (sp: a scan) [ms]", record.stages);
}

report::Table account_table(const BudgetRecord& record) {
  const ScanCounts& s = record.scans;
  report::Table t{{"scans", "count", "share"}, {}};
  const auto add = [&](const std::string& name, std::int64_t count) {
    t.rows.push_back(
        {name, std::to_string(count), fmt::format("{:.2f} %", 100.0 * share_of(count, s.sent))});
  };
  add("sent", s.sent);
  add("used, full work", s.full);
  add("used, degraded", s.degraded);
  add("held", s.held);
  add("failed", s.failed);
  add("dropped", s.dropped);
  add("unaccounted", s.unaccounted);
  t.rows.push_back({"facets lost / rejected / sent",
                    fmt::format("{} / {} / {}", s.facets_lost, s.facets_refused, s.facets_sent),
                    ""});
  for (const auto& [name, node] : record.nodes) {
    t.rows.push_back({fmt::format("{}: overruns of {}", name, node.cycles),
                      std::to_string(node.overruns),
                      fmt::format("{:.2f} %", 100.0 * node.overrun_share())});
    if (node.missed > 0) {
      t.rows.push_back({name + ": periods missed", std::to_string(node.missed), ""});
    }
  }
  return t;
}

report::Table verdict_table(const std::vector<BudgetVerdict>& verdicts) {
  report::Table t{{"budget", "value", "limit", ""}, {}};
  for (const BudgetVerdict& v : verdicts) {
    t.rows.push_back({v.name, v.measured ? fmt::format("{:.4g}", v.value) : "not measured",
                      fmt::format("{:g}", v.limit), v.kept() ? "met" : "EXCEEDED"});
  }
  t.note = "ms: latency in milliseconds; share: of the scans, or of the cycles of a node";
  return t;
}

Json to_json(const BudgetRecord& record, const std::vector<BudgetVerdict>& verdicts) {
  const ScanCounts& s = record.scans;
  Json out = {{"laps", record.laps},
              {"scans",
               {{"sent", s.sent},
                {"full", s.full},
                {"degraded", s.degraded},
                {"held", s.held},
                {"failed", s.failed},
                {"dropped", s.dropped},
                {"unaccounted", s.unaccounted},
                {"results_not_received", s.not_received},
                {"facets_sent", s.facets_sent},
                {"facets_lost", s.facets_lost},
                {"facets_rejected", s.facets_refused}}},
              {"nodes", Json::object()},
              {"hops", to_json(record.hops)},
              {"stages", to_json(record.stages)},
              {"limits", Json::array()}};
  for (const auto& [name, node] : record.nodes) {
    out["nodes"][name] = {{"cycles", node.cycles},
                          {"overruns", node.overruns},
                          {"overrun_share", node.overrun_share()},
                          {"missed", node.missed}};
  }
  bool all_kept = true;
  for (const BudgetVerdict& v : verdicts) {
    Json verdict = {{"name", v.name}, {"limit", v.limit}, {"met", v.kept()}};
    verdict["value"] = v.measured ? Json(v.value) : Json(nullptr);
    out["limits"].push_back(verdict);
    all_kept = all_kept && v.kept();
  }
  out["met"] = all_kept;
  return out;
}

report::Plot budget_plot(const BudgetRecord& record, const BudgetLimits& limits,
                         const std::string& title) {
  constexpr int kBins = 120;
  const std::vector<double>& nav = values_of(record.hops, kToNavState);
  const std::vector<double>& drive = values_of(record.hops, kToDrive);
  const std::vector<double>& work = values_of(record.hops, kSpWork);
  double longest_ms = 1.0;
  for (const std::vector<double>* values : {&nav, &drive, &work}) {
    for (const double v : *values) longest_ms = std::max(longest_ms, v);
  }
  const double bin_ms = 1.0001 * longest_ms / kBins;

  report::Plot plot;
  plot.title = title;
  plot.x_label = "[ms]";
  plot.y_label = "scans (log scale)";
  plot.log_y = true;
  plot.series.push_back(outline(kToNavState, report::Colour::kBlue, report::SeriesStyle::kThickLine,
                                nav, bin_ms, kBins));
  if (!drive.empty()) {
    plot.series.push_back(outline(kToDrive, report::Colour::kPurple,
                                  report::SeriesStyle::kThickLine, drive, bin_ms, kBins));
  }
  plot.series.push_back(
      outline(kSpWork, report::Colour::kOrange, report::SeriesStyle::kLine, work, bin_ms, kBins));
  const std::optional<double>& limit = limits.nav_state.p99_ms;
  if (limit && *limit < kBins * bin_ms) {
    plot.shades = {{*limit, kBins * bin_ms, "beyond the p99 budget of nav_state"}};
  }
  return plot;
}

}  // namespace rcs::evaluation

// The whole vehicle drives for half an hour: memory, descriptors and allocations stay constant
// after the first minute. RCS_SOAK_MINUTES: duration, default 30.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "rcs/node/report.h"
#include "tests/live_faults/live_fault.h"
#include "tools/report/table.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kPatience = from_seconds(60.0);
constexpr Duration kWarm = from_seconds(60.0);
/// Buffers are reserved at the start and their pages touched when they are first needed (0.25 MB of
/// bg after the first minute), and the queue of LCM varies (0.2 MB of wm). A leak of one small
/// message a second would exceed this in half an hour.
constexpr double kMaxGrowth_kb = 1024.0;

/// One metric of a process, once a second.
struct Series {
  std::vector<double> t_s;
  std::vector<double> value;

  void add(Stamp at, std::int64_t v) {
    t_s.push_back(1e-6 * static_cast<double>(to_utime(at)));
    value.push_back(static_cast<double>(v));
  }
  /// Slope per minute, by least squares.
  [[nodiscard]] double slope() const {
    double mean_t = 0.0;
    double mean_v = 0.0;
    const auto n = static_cast<double>(value.size());
    for (std::size_t i = 0; i < value.size(); ++i) {
      mean_t += t_s[i] / n;
      mean_v += value[i] / n;
    }
    double tt = 0.0;
    double tv = 0.0;
    for (std::size_t i = 0; i < value.size(); ++i) {
      tt += (t_s[i] - mean_t) * (t_s[i] - mean_t);
      tv += (t_s[i] - mean_t) * (value[i] - mean_v);
    }
    return tt > 0.0 ? 60.0 * tv / tt : 0.0;
  }
  [[nodiscard]] double range() const {
    const auto [low, high] = std::minmax_element(value.begin(), value.end());
    return value.empty() ? 0.0 : *high - *low;
  }
  /// Increase of the maximum from the first quarter to the last: variation within a lap of the
  /// course is no growth.
  [[nodiscard]] double growth() const {
    const auto quarter = static_cast<std::ptrdiff_t>(value.size() / 4);
    if (quarter == 0) return 0.0;
    return *std::max_element(value.end() - quarter, value.end()) -
           *std::max_element(value.begin(), value.begin() + quarter);
  }
};

struct NodeSeries {
  Series rss_kb, heap_kb, descriptors;
  std::int64_t pid = 0;
  std::int64_t first_overruns = -1;
  std::int64_t overruns = 0;
  std::map<std::string, std::int64_t> dropped;  // by channel
  std::int64_t dropped_before = 0;              // warm

  [[nodiscard]] std::int64_t all_dropped() const {
    std::int64_t all = 0;
    for (const auto& [channel, count] : dropped) all += count;
    return all;
  }
};

TEST(Soak, MemoryDescriptorsAndAllocationsStayConstant) {
  const int minutes = number_from("RCS_SOAK_MINUTES", 30);
  LiveFault drill;
  ASSERT_EQ(drill.run.trouble(), "");
  drill.run.keep_client();
  std::map<std::string, NodeSeries> series;
  bool warm = false;
  scan_account_t scans{};
  scan_account_t scans_before{};
  std::deque<Tap<process_t>> processes;
  std::deque<Tap<cycle_t>> cycles;
  for (const std::string& node : kNodes) {
    processes.emplace_back(drill.run.bus(), channel_of(node, "PROCESS"),
                           [&](const process_t& m, Stamp arrival) {
                             if (!warm) return;
                             NodeSeries& s = series[m.node];
                             EXPECT_TRUE(s.pid == 0 || s.pid == m.pid) << m.node << " died";
                             s.pid = m.pid;
                             s.rss_kb.add(arrival, m.rss_kb);
                             s.heap_kb.add(arrival, m.heap_kb);
                             s.descriptors.add(arrival, m.descriptors);
                             if (s.first_overruns < 0) s.first_overruns = m.overruns;
                             s.overruns = m.overruns;
                           });
    cycles.emplace_back(drill.run.bus(), channel_of(node, "CYCLE"), [&](const cycle_t& m, Stamp) {
      for (const input_account_t& i : m.input) series[m.node].dropped[i.channel] = i.dropped;
    });
  }
  const Tap<registration_t> registrations(
      drill.run.bus(), channel::kSpRegistration,
      [&](const registration_t& m, Stamp) { scans = m.account; });
  ASSERT_TRUE(drill.run_until_well(kPatience)) << drill.recovery.missing();

  drill.run_for(kWarm);
  warm = true;
  for (auto& [node, s] : series) s.dropped_before = s.all_dropped();
  scans_before = scans;
  drill.safety.reset();
  drill.run_for(std::chrono::minutes(minutes) - kWarm);
  const SafetyMetrics driven = drill.safety.metrics();

  report::Table table;
  table.header = {"node",    "rss MB",   "kB/min",   "range kB",  "growth kB",
                  "heap kB", "kB/min",   "range kB", "growth kB", "descriptors",
                  "growth",  "overruns", "dropped"};
  for (const std::string& node : kNodes) {
    NodeSeries& s = series[node];
    ASSERT_FALSE(s.rss_kb.value.empty()) << node;
    std::vector<std::string> cells = {node, fmt::format("{:.1f}", s.rss_kb.value.back() / 1024.0)};
    for (const Series* kb : {&s.rss_kb, &s.heap_kb}) {
      if (kb == &s.heap_kb) cells.push_back(fmt::format("{:.0f}", kb->value.back()));
      cells.push_back(fmt::format("{:.2f}", kb->slope()));
      cells.push_back(fmt::format("{:.0f}", kb->range()));
      cells.push_back(fmt::format("{:.0f}", kb->growth()));
      EXPECT_LE(kb->growth(), kMaxGrowth_kb) << node;
    }
    cells.push_back(fmt::format("{:.0f}", s.descriptors.value.back()));
    cells.push_back(fmt::format("{:.0f}", s.descriptors.growth()));
    EXPECT_LE(s.descriptors.growth(), 0.0) << node;
    cells.push_back(std::to_string(s.overruns - s.first_overruns));
    cells.push_back(std::to_string(s.all_dropped() - s.dropped_before));
    table.rows.push_back(std::move(cells));
  }
  const std::string sim = drill.run.end();
  std::printf("%s", to_text(table).c_str());
  std::printf("%lld scans, %lld degraded, %lld held, %lld failed, %lld dropped\n",
              static_cast<long long>(scans.answered - scans_before.answered),
              static_cast<long long>(scans.degraded - scans_before.degraded),
              static_cast<long long>(scans.held - scans_before.held),
              static_cast<long long>(scans.failed - scans_before.failed),
              static_cast<long long>(scans.dropped - scans_before.dropped));
  std::printf(
      "%.0f m driven, %d collisions, least clearance %.2f m, longest stand %.1f s, %d "
      "courses begun, the operator gave up %zu times\n%s\n",
      driven.driven_m, driven.collisions, driven.clearance_m, seconds(driven.longest_stand),
      drill.run.courses(), drill.run.gave_up().size(), sim.c_str());
  EXPECT_EQ(drill.run.trouble(), "");
  EXPECT_EQ(drill.breaches(), "");
  EXPECT_LT(driven.longest_stand, from_seconds(30.0)) << "the vehicle must drive all the time";
}

}  // namespace
}  // namespace rcs::live_faults

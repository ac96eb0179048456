#include "tools/evaluation/latency_trace.h"

#include <algorithm>

#include "lcmtypes/convert.h"

namespace rcs::evaluation {
namespace {

std::vector<double>* values_for(Samples* samples, const std::string& name) {
  const auto known = std::find_if(samples->begin(), samples->end(),
                                  [&](const auto& entry) { return entry.first == name; });
  if (known != samples->end()) return &known->second;
  return &samples->emplace_back(name, std::vector<double>()).second;
}

void append(Samples* to, const Samples& from) {
  for (const auto& [name, values] : from) {
    std::vector<double>* all = values_for(to, name);
    all->insert(all->end(), values.begin(), values.end());
  }
}

/// The hops of a scan in order, so that a hop that the first scan lacks is not listed last.
Samples all_hops() {
  Samples hops;
  for (const char* name :
       {"first facet -> last facet, in sp", "last facet sent -> arrival in sp",
        "sp: last facet -> start", kSpWork, "hop sp -> wm", "wm: arrival -> start", "wm: work",
        "hop wm -> bg", "bg: arrival -> start", "bg: work", kToNavState, kToDrive}) {
    hops.emplace_back(name, std::vector<double>());
  }
  return hops;
}

void note(Samples* hops, const char* name, Duration d) {
  values_for(hops, name)->push_back(milliseconds(d));
}

Duration between(std::int64_t from_utime, std::int64_t to_utime) {
  return Duration(to_utime - from_utime);
}

}  // namespace

void ScanCounts::add(const ScanCounts& other) {
  sent += other.sent;
  full += other.full;
  degraded += other.degraded;
  held += other.held;
  failed += other.failed;
  dropped += other.dropped;
  unaccounted += other.unaccounted;
  not_received += other.not_received;
  facets_sent += other.facets_sent;
  facets_lost += other.facets_lost;
  facets_refused += other.facets_refused;
}

const std::vector<double>& values_of(const Samples& samples, const std::string& name) {
  static const std::vector<double> none;
  const auto known = std::find_if(samples.begin(), samples.end(),
                                  [&](const auto& entry) { return entry.first == name; });
  return known == samples.end() ? none : known->second;
}

void BudgetRecord::add(const BudgetRecord& other) {
  scans.add(other.scans);
  for (const auto& [name, node] : other.nodes) {
    NodeCounts& sum = nodes[name];
    sum.cycles += node.cycles;
    sum.overruns += node.overruns;
    sum.missed += node.missed;
  }
  append(&hops, other.hops);
  append(&stages, other.stages);
  laps += other.laps;
}

void ScanLatencyTrace::sent(std::int64_t reference_utime, Stamp at) {
  scans_[reference_utime].last_sent = at;
  ++facets_sent_;
}

void ScanLatencyTrace::accept(const registration_t& m) {
  account_ = m.account;
  if (m.target != registration_t::TARGET_ROLLING) return;
  const auto scan = scans_.find(m.latency_trace.measured_utime);
  // A new map after a failure gives a second result for the same scan.
  if (scan == scans_.end() || scan->second.answer) return;
  scan->second.answer = SpResult{m.stop, m.degrade_level, m.facets_lost, m.latency_trace};
}

void ScanLatencyTrace::accept(const nav_state_t& m) {
  const auto scan = scans_.find(m.latency_trace.measured_utime);
  if (scan == scans_.end() || m.latency_trace.wm_start_utime == 0) return;
  if (!scan->second.nav_state) scan->second.nav_state = m.latency_trace;
}

void ScanLatencyTrace::accept(const drive_t& m) {
  const auto scan = scans_.find(m.latency_trace.measured_utime);
  if (scan == scans_.end() || m.latency_trace.bg_start_utime == 0) return;
  if (!scan->second.driven_by) scan->second.driven_by = m.latency_trace;
}

void ScanLatencyTrace::accept(const cycle_t& m) {
  Cycles& cycles = cycles_[m.node];
  cycles.by_start[m.utime] = m;
  cycles.newest = m;
}

BudgetRecord ScanLatencyTrace::close() const {
  BudgetRecord record;
  record.laps = 1;
  record.scans = count();
  record.hops = all_hops();
  for (const auto& [reference, scan] : scans_) trace(scan, &record.hops);
  for (const auto& [name, cycles] : cycles_) {
    NodeCounts& node = record.nodes[name];
    node.cycles = static_cast<std::int64_t>(cycles.by_start.size());
    node.overruns = cycles.newest.overruns;
    node.missed = cycles.newest.missed;
    for (const auto& [start, cycle] : cycles.by_start) {
      values_for(&record.stages, name)->push_back(milliseconds(Duration(cycle.used_wall_us)));
      values_for(&record.stages, name + ": CPU")
          ->push_back(milliseconds(Duration(cycle.used_cpu_us)));
      values_for(&record.stages, name + ": late")->push_back(milliseconds(Duration(cycle.late_us)));
      for (const stage_t& stage : cycle.stage) {
        values_for(&record.stages, name + ": " + stage.name)
            ->push_back(milliseconds(Duration(stage.wall_us)));
      }
    }
  }
  return record;
}

ScanCounts ScanLatencyTrace::count() const {
  ScanCounts counts;
  counts.sent = static_cast<std::int64_t>(scans_.size());
  counts.facets_sent = facets_sent_;
  counts.facets_lost = account_.facets_lost;
  counts.facets_refused = account_.facets_refused;
  std::int64_t silent = 0;
  for (const auto& [reference, scan] : scans_) {
    if (!scan.answer) {
      ++silent;
    } else if (scan.answer->stop == registration_t::STOP_HELD) {
      ++counts.held;
    } else if (!is_answer(scan.answer->stop)) {
      ++counts.failed;
    } else if (scan.answer->degrade_level > 0) {
      ++counts.degraded;
    } else {
      ++counts.full;
    }
  }
  // Scans without a result: either the published result was lost in transmission, or sp missed the
  // scan and reports it.
  const std::int64_t received = counts.sent - silent;
  counts.not_received = std::clamp<std::int64_t>(account_.answered - received, 0, silent);
  counts.full += counts.not_received;
  counts.dropped = std::clamp<std::int64_t>(account_.dropped, 0, silent - counts.not_received);
  counts.unaccounted = silent - counts.not_received - counts.dropped;
  return counts;
}

void ScanLatencyTrace::trace(const Scan& scan, Samples* hops) const {
  if (!scan.answer) return;
  const latency_trace_t& sp = scan.answer->latency_trace;
  note(hops, "first facet -> last facet, in sp",
       between(sp.first_facet_utime, sp.last_facet_utime));
  const Stamp arrival = from_utime(sp.last_facet_utime);
  // If the last facets are lost, the last facet sent is not the last one received.
  if (scan.answer->facets_lost == 0) {
    note(hops, "last facet sent -> arrival in sp", arrival - scan.last_sent);
  }
  note(hops, "sp: last facet -> start", between(sp.last_facet_utime, sp.sp_start_utime));
  const std::optional<Duration> answering_time = answering(sp.sp_start_utime);
  if (answering_time) note(hops, kSpWork, *answering_time);
  if (!scan.nav_state) return;

  const latency_trace_t& wm = *scan.nav_state;
  if (answering_time) {
    const Duration hop = between(sp.sp_start_utime, wm.wm_arrival_utime) - *answering_time;
    note(hops, "hop sp -> wm", hop);
  }
  note(hops, "wm: arrival -> start", between(wm.wm_arrival_utime, wm.wm_start_utime));
  const std::optional<Duration> wm_wall = wall_of("wm", wm.wm_start_utime);
  if (wm_wall) {
    note(hops, "wm: work", *wm_wall);
    note(hops, kToNavState, from_utime(wm.wm_start_utime) + *wm_wall - scan.last_sent);
  }
  if (!scan.driven_by) return;

  const latency_trace_t& bg = *scan.driven_by;
  if (wm_wall) {
    note(hops, "hop wm -> bg", between(bg.wm_start_utime, bg.bg_arrival_utime) - *wm_wall);
  }
  note(hops, "bg: arrival -> start", between(bg.bg_arrival_utime, bg.bg_start_utime));
  if (const std::optional<Duration> bg_wall = wall_of("bg", bg.bg_start_utime)) {
    note(hops, "bg: work", *bg_wall);
    note(hops, kToDrive, from_utime(bg.bg_start_utime) + *bg_wall - scan.last_sent);
  }
}

std::optional<Duration> ScanLatencyTrace::wall_of(const std::string& node,
                                                  std::int64_t start) const {
  const auto cycles = cycles_.find(node);
  if (cycles == cycles_.end()) return std::nullopt;
  const auto cycle = cycles->second.by_start.find(start);
  if (cycle == cycles->second.by_start.end()) return std::nullopt;
  return Duration(cycle->second.used_wall_us);
}

std::optional<Duration> ScanLatencyTrace::answering(std::int64_t start) const {
  const auto cycles = cycles_.find("sp");
  if (cycles == cycles_.end()) return std::nullopt;
  const auto cycle = cycles->second.by_start.find(start);
  if (cycle == cycles->second.by_start.end()) return std::nullopt;
  Duration sum{};
  for (const stage_t& stage : cycle->second.stage) {
    // Facets are converted on arrival, all but the last before this cycle.
    const bool before = stage.name == "convert";
    const bool after = stage.name == "prior" || stage.name == "map" || stage.name == "publish";
    if (!before && !after) sum += Duration(stage.wall_us);
  }
  return sum;
}

}  // namespace rcs::evaluation

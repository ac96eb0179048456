#pragma once
// Outcome and latencies of every scan that was sent, from the messages of the nodes. Pure.

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "rcs/base/stamp.h"

namespace rcs::evaluation {

/// Every scan is exactly one of full, degraded, held, failed, dropped and unaccounted.
struct ScanCounts {
  std::int64_t sent = 0;
  std::int64_t full = 0;         ///< registered with full work
  std::int64_t degraded = 0;     ///< registered with reduced work
  std::int64_t held = 0;         ///< result without a registration
  std::int64_t failed = 0;       ///< without a usable result
  std::int64_t dropped = 0;      ///< sp reports that none of its facets arrived
  std::int64_t unaccounted = 0;  ///< no message accounts for it
  /// Of the full ones: reported by sp, but the result was not received here.
  std::int64_t not_received = 0;
  std::int64_t facets_sent = 0;
  std::int64_t facets_lost = 0;
  std::int64_t facets_refused = 0;

  void add(const ScanCounts& other);
};

struct NodeCounts {
  std::int64_t cycles = 0;    ///< reported cycles; of sp one for each scan
  std::int64_t overruns = 0;  ///< cycles that ended after their deadline
  std::int64_t missed = 0;    ///< periods skipped

  /// Of the cycles.
  [[nodiscard]] double overrun_share() const {
    return cycles == 0 ? 0.0 : static_cast<double>(overruns) / static_cast<double>(cycles);
  }
};

/// Milliseconds by name, in temporal order.
using Samples = std::vector<std::pair<std::string, std::vector<double>>>;

/// The values of `name`; empty if none was added.
[[nodiscard]] const std::vector<double>& values_of(const Samples& samples, const std::string& name);

inline constexpr char kToNavState[] = "last facet sent -> nav_state";
inline constexpr char kToDrive[] = "last facet sent -> drive";
inline constexpr char kSpWork[] = "sp: start -> result";

/// Pooled over laps.
struct BudgetRecord {
  ScanCounts scans;
  std::map<std::string, NodeCounts> nodes;
  Samples hops;    ///< of the hops of a scan, and of the whole chains
  Samples stages;  ///< wall time of each stage of each node, and its start delay
  int laps = 0;

  void add(const BudgetRecord& other);
};

/// Accounting of one lap with one set of processes.
class ScanLatencyTrace {
 public:
  /// A facet was sent; facets of a scan in order of time.
  void sent(std::int64_t reference_utime, Stamp at);
  void accept(const registration_t& m);
  void accept(const nav_state_t& m);
  void accept(const drive_t& m);
  void accept(const cycle_t& m);

  /// Call it after the last message.
  [[nodiscard]] BudgetRecord close() const;

 private:
  struct SpResult {
    std::int8_t stop = 0;
    std::int8_t degrade_level = 0;
    std::int16_t facets_lost = 0;
    latency_trace_t latency_trace{};
  };
  struct Scan {
    Stamp last_sent;
    std::optional<SpResult> answer;            ///< the first, to the rolling map
    std::optional<latency_trace_t> nav_state;  ///< of the first belief that uses it
    std::optional<latency_trace_t> driven_by;  ///< of the first drive command
  };
  struct Cycles {
    std::map<std::int64_t, cycle_t> by_start;
    cycle_t newest{};
  };

  [[nodiscard]] ScanCounts count() const;
  void trace(const Scan& scan, Samples* hops) const;
  /// Wall time of a cycle of a node; nullopt if its cycle_t was not received.
  [[nodiscard]] std::optional<Duration> wall_of(const std::string& node, std::int64_t start) const;
  /// Time of sp until the result for the rolling map is published; the a priori match follows.
  [[nodiscard]] std::optional<Duration> answering(std::int64_t start) const;

  std::map<std::int64_t, Scan> scans_;  // by reference instant, which every latency_trace carries
  std::map<std::string, Cycles> cycles_;
  std::int64_t facets_sent_ = 0;
  scan_account_t account_{};  // the newest
};

}  // namespace rcs::evaluation

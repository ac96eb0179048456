#pragma once
// The figures of a budget run against what was allowed, as tables, JSON and a picture.

#include <optional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/node/params/params.h"
#include "tools/evaluation/evaluation_tables.h"
#include "tools/evaluation/latency_trace.h"
#include "tools/report/svg_plot.h"

namespace rcs::evaluation {

/// Of a chain, from the sending of a scan's last facet; none: not limited.
struct ChainLimits {
  std::optional<double> p50_ms;
  std::optional<double> p99_ms;
  std::optional<double> p999_ms;
  std::optional<double> max_ms;
};

/// Table [budget] of the vehicle's configuration. Shares are of the scans sent.
struct BudgetLimits {
  ChainLimits nav_state;  ///< facet_to_nav_state_{p50,p99,p999,max}_ms
  ChainLimits drive;      ///< facet_to_drive_{p50,p99,p999,max}_ms
  std::int64_t unaccounted_scans = 0;
  std::optional<double> degraded_share;
  std::optional<double> held_share;
  std::optional<double> failed_share;
  std::optional<double> dropped_share;
  std::optional<double> overrun_share;  ///< of each node's units of work
};
[[nodiscard]] Result<BudgetLimits> read_budget_limits(const ParamFile& file);

/// One limit and what was measured.
struct BudgetVerdict {
  std::string name;  ///< the key in [budget], with the node where there are several
  double figure = 0.0;
  double limit = 0.0;
  bool measured = true;  ///< false: there is nothing to compare, which keeps no promise

  [[nodiscard]] bool kept() const { return measured && figure <= limit; }
};
[[nodiscard]] std::vector<BudgetVerdict> judge(const BudgetRecord& record,
                                               const BudgetLimits& limits);

[[nodiscard]] report::Table hop_table(const BudgetRecord& record);
[[nodiscard]] report::Table stage_table(const BudgetRecord& record);
[[nodiscard]] report::Table account_table(const BudgetRecord& record);
[[nodiscard]] report::Table verdict_table(const std::vector<BudgetVerdict>& verdicts);
[[nodiscard]] Json to_json(const BudgetRecord& record, const std::vector<BudgetVerdict>& verdicts);

/// How often the chains, and sp's part of them, took how long.
[[nodiscard]] report::Plot budget_plot(const BudgetRecord& record, const BudgetLimits& limits,
                                       const std::string& title);

}  // namespace rcs::evaluation

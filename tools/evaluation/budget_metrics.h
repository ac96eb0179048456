#pragma once
// The metrics of a budget run against the limits, as tables, JSON and a plot.

#include <optional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/node/params/params.h"
#include "tools/evaluation/evaluation_tables.h"
#include "tools/evaluation/latency_trace.h"
#include "tools/report/svg_plot.h"

namespace rcs::evaluation {

/// Limits of a chain, from the sending of the last facet of a scan; nullopt: no limit.
struct ChainLimits {
  std::optional<double> p50_ms;
  std::optional<double> p99_ms;
  std::optional<double> p999_ms;
  std::optional<double> max_ms;
};

/// Table [budget] of the configuration. Shares are of the scans sent.
struct BudgetLimits {
  ChainLimits nav_state;  ///< facet_to_nav_state_{p50,p99,p999,max}_ms
  ChainLimits drive;      ///< facet_to_drive_{p50,p99,p999,max}_ms
  std::int64_t unaccounted_scans = 0;
  std::optional<double> degraded_share;
  std::optional<double> held_share;
  std::optional<double> failed_share;
  std::optional<double> dropped_share;
  std::optional<double> overrun_share;  ///< of the cycles of each node
};
[[nodiscard]] Result<BudgetLimits> read_budget_limits(const ParamFile& file);

/// One limit and the measured value.
struct BudgetVerdict {
  std::string name;  ///< key in [budget], with the node if there are several
  double value = 0.0;
  double limit = 0.0;
  bool measured = true;  ///< false: no value, the limit is not met

  [[nodiscard]] bool kept() const { return measured && value <= limit; }
};
[[nodiscard]] std::vector<BudgetVerdict> judge(const BudgetRecord& record,
                                               const BudgetLimits& limits);

[[nodiscard]] report::Table hop_table(const BudgetRecord& record);
[[nodiscard]] report::Table stage_table(const BudgetRecord& record);
[[nodiscard]] report::Table account_table(const BudgetRecord& record);
[[nodiscard]] report::Table verdict_table(const std::vector<BudgetVerdict>& verdicts);
[[nodiscard]] Json to_json(const BudgetRecord& record, const std::vector<BudgetVerdict>& verdicts);

/// Histograms of the latencies of the chains and of the part of sp.
[[nodiscard]] report::Plot budget_plot(const BudgetRecord& record, const BudgetLimits& limits,
                                       const std::string& title);

}  // namespace rcs::evaluation

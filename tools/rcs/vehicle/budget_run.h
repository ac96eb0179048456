#pragma once
// A log's sensor data at the speed of its recording through the live processes, lap after lap, each
// with new processes, and the books of what they made of it.

#include <functional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "tools/evaluation/latency_trace.h"

namespace rcs::cli {

struct BudgetPlan {
  std::string config;              ///< of the vehicle
  std::string log;                 ///< with sensor channels
  std::string lcm_url;             ///< empty: the default
  std::vector<std::string> nodes;  ///< their programs lie beside this one
  std::vector<std::string> load;   ///< "cpu", "io", "memory"
  Duration length{};               ///< the last lap ends with the scan that is under way then
};

struct BudgetRun {
  evaluation::BudgetRecord record;
  Duration played{};
  Duration worst_send{};         ///< a message of the log that went out late by so much
  std::int64_t missed_here = 0;  ///< messages of the nodes that did not reach the books
  bool interrupted = false;      ///< by Ctrl-C: what was measured until then counts
};

/// @param progress  now and then, with the share that is done
[[nodiscard]] Result<BudgetRun> run_budget(const BudgetPlan& plan,
                                           const std::function<void(double)>& progress);

}  // namespace rcs::cli

#pragma once
// Plays the sensor data of a log in real time to live processes, in laps, each with new processes,
// and records the times of the results.

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
  std::vector<std::string> nodes;  ///< their programs are next to this one
  std::vector<std::string> load;   ///< "cpu", "io", "memory"
  Duration length{};               ///< the last lap ends with the scan in progress
};

struct BudgetRun {
  evaluation::BudgetRecord record;
  Duration played{};
  Duration worst_send{};         ///< maximum delay of a message of the log
  std::int64_t missed_here = 0;  ///< messages of the nodes that were not received
  bool interrupted = false;      ///< by Ctrl-C: the measurements until then are valid
};

/// @param progress  called occasionally with the completed share
[[nodiscard]] Result<BudgetRun> run_budget(const BudgetPlan& plan,
                                           const std::function<void(double)>& progress);

}  // namespace rcs::cli

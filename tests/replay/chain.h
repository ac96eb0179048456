#pragma once
// The whole chain in one thread: the reference simulation drives SP and WM in lockstep.

#include <functional>
#include <string>

#include "rcs/node/node.h"
#include "sim/scenario.h"

namespace rcs::test {

struct ChainRun {
  int scans = 0;  ///< results of the match to the rolling map
  int prior_matches = 0;
};

/// Called around every cycle with the node that runs, before (true) and after (false).
using AroundCycle = std::function<void(const Node&, bool)>;

/// @param vehicle_config  path of a vehicle's configuration; SP gets the scenario's a priori map
[[nodiscard]] ChainRun run_chain(const sim::Scenario& scenario, const std::string& vehicle_config,
                                 const AroundCycle& around_cycle);

/// Root of RCS_SOURCE_DIR, which the tests' CMake sets.
[[nodiscard]] std::string source_path(const std::string& relative);

}  // namespace rcs::test

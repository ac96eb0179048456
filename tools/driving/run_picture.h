#pragma once
// The picture of a closed-loop run.

#include <string>

#include "tools/driving/closed_loop.h"

namespace rcs::driving {

/// From above, with the course, the terrain, plans, zones and routes; a self-contained SVG.
[[nodiscard]] std::string draw(const ClosedLoopRun& run, const sim::Scenario& scenario,
                               const std::string& title);

}  // namespace rcs::driving

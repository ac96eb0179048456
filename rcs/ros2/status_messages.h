#pragma once
// Events and accounts of nodes as messages of ROS 2.

#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "rcs/ros2/frames.h"
#include "rcs/ros2/status_types.h"

namespace rcs::ros2 {

/// The logger is the node, the text "code: text".
[[nodiscard]] msg::Log to_log(const event_t& m, const ClockOffsets& clocks);

/// Status "NODE: cycle": a warning if the cycle ended after its deadline or left out work.
[[nodiscard]] msg::DiagnosticArray to_diagnostics(const cycle_t& m, const ClockOffsets& clocks);

/// Status "NODE: process": a warning if the node leaves out work or lacks requested resources.
[[nodiscard]] msg::DiagnosticArray to_diagnostics(const process_t& m, const ClockOffsets& clocks);

}  // namespace rcs::ros2

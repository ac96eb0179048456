#pragma once
// The content of a command that sends a vehicle along waypoints.

#include <string_view>

#include "lcmtypes/rcs/command_t.hpp"

namespace rcs {

constexpr int kMaxWaypoints = 64;  ///< of a command

/// Why the waypoints of a command cannot be driven to, whatever their frame is; empty: they can.
[[nodiscard]] std::string_view waypoint_objection(const command_t& m);

}  // namespace rcs

#pragma once
// Conversion between the messages of the vehicle, the samples of vehicle.idl and the gateway's
// types.

#include <string>

#include "lcmtypes/rcs/nav_state_t.hpp"
#include "modules/gateway/command_arbiter.h"
#include "modules/gateway/node_status_table.h"
#include "rcs/base/stamp.h"
#include "rcs/node/command_port.h"
#include "vehicle.h"

namespace rcs::gateway {

/// Truncated to the size of `out`.
template <std::size_t N>
void to_sample(std::string_view text, char (&out)[N]) {
  const std::size_t n = text.copy(out, N - 1);
  out[n] = '\0';
}

/// @param age  of the message, in node time
/// @return false, and `out` undefined: a number that is not finite, or an unknown mode
[[nodiscard]] bool to_sample(const nav_state_t& m, Duration age, rcs_VehicleState* out);

/// Sets all fields but `vehicle` and `seq`.
void to_sample(const NodeStatusTable& table, std::size_t node, Stamp now, rcs_NodeStatus* out);

/// @param writer_partition  partition of the writer of the sample; an operator_id that differs from
/// it
///   becomes empty (not authorized)
[[nodiscard]] WaypointCommand from_sample(const rcs_WaypointCommand& sample,
                                          std::string_view writer_partition);
[[nodiscard]] StopCommand from_sample(const rcs_EmergencyStop& sample,
                                      std::string_view writer_partition);

[[nodiscard]] Command to_command(const Action& action);

}  // namespace rcs::gateway

#pragma once
// Between the vehicle's messages, the samples of vehicle.idl and the core's own types.

#include <string>

#include "lcmtypes/rcs/nav_state_t.hpp"
#include "modules/gateway/command_arbiter.h"
#include "modules/gateway/node_status_table.h"
#include "rcs/base/stamp.h"
#include "rcs/node/command_port.h"
#include "vehicle.h"

namespace rcs::gateway {

/// Shortened to what fits.
template <std::size_t N>
void to_sample(std::string_view text, char (&out)[N]) {
  const std::size_t n = text.copy(out, N - 1);
  out[n] = '\0';
}

/// @param age  of the message, in node time
/// @return false, and `out` undefined: a number that is not finite, or an unknown mode
[[nodiscard]] bool to_sample(const nav_state_t& m, Duration age, rcs_VehicleState* out);

/// Everything but `vehicle` and `seq`.
void to_sample(const NodeBoard& board, std::size_t node, Stamp now, rcs_NodeStatus* out);

/// @param speaks_for  whose partition the sample's writer is in; another operator_id than that one
///                    becomes empty: nobody's
[[nodiscard]] WaypointOrder from_sample(const rcs_WaypointCommand& sample,
                                        std::string_view speaks_for);
[[nodiscard]] StopOrder from_sample(const rcs_EmergencyStop& sample, std::string_view speaks_for);

[[nodiscard]] Order to_order(const Action& action);

}  // namespace rcs::gateway

#pragma once
// Operator commands shared by the tests of the gateway.

#include <string>

#include "modules/gateway/operator_commands.h"

namespace rcs::gateway::test {

inline WaypointCommand go_to(const std::string& operator_id, std::int64_t command_id) {
  WaypointCommand order;
  order.operator_id = operator_id;
  order.command_id = command_id;
  order.kind = kKindGoto;
  order.valid_for = from_seconds(2.0);
  order.waypoints = {{{10.0, 0.0, 0.0}, 2.0, 3.0}, {{20.0, 5.0, 0.0}, 2.0, 3.0}};
  return order;
}

inline WaypointCommand halt(const std::string& operator_id, std::int64_t command_id) {
  WaypointCommand order;
  order.operator_id = operator_id;
  order.command_id = command_id;
  return order;
}

}  // namespace rcs::gateway::test

#pragma once
// Configuration of the gateway.

#include <string>
#include <vector>

#include "modules/gateway/command_arbiter.h"
#include "modules/gateway/dds_params.h"
#include "modules/gateway/node_status_table.h"
#include "rcs/base/result.h"
#include "rcs/node/command_port.h"
#include "rcs/node/node.h"
#include "rcs/node/params/params.h"

namespace rcs::gateway {

struct GatewayConfig {
  NodeInfo info{"gateway", from_milliseconds(20.0), from_milliseconds(1.0)};
  std::string vehicle = "vehicle";                      ///< [vehicle] name
  Duration period = from_milliseconds(50.0);            ///< of a cycle
  Duration state_period = from_milliseconds(100.0);     ///< of VehicleState
  Duration state_max_age = from_seconds(1.0);           ///< no VehicleState from an older belief
  std::vector<std::string> nodes = {"sp", "wm", "bg"};  ///< whose status is published
  bool unsecured = false;                               ///< explicitly without keys
  DdsParams dds;
  NodeStatusParams node_status;
  ArbiterParams arbiter;
  CommandPortParams port;          ///< to BG
  CommandPortParams mission_port;  ///< with arbiter.limits.tasks
};

/// Reads [gateway] and the name of the vehicle; ignores the tables of other nodes.
[[nodiscard]] Result<GatewayConfig> load_gateway_config(const ParamFile& file);

}  // namespace rcs::gateway

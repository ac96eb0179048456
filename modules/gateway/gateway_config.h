#pragma once
// The gateway's part of a vehicle configuration.

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
  Duration state_max_age = from_seconds(1.0);           ///< an older belief is not told
  std::vector<std::string> nodes = {"sp", "wm", "bg"};  ///< whose status is told
  bool plain = false;                                   ///< without keys, and meant so
  DdsParams dds;
  BoardParams board;
  DeskParams desk;
  CommandPortParams port;
};

/// Reads [gateway] and the vehicle's name; tables of other nodes are not looked at.
[[nodiscard]] Result<GatewayConfig> load_gateway_config(const ParamFile& file);

}  // namespace rcs::gateway

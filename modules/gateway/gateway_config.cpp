#include "modules/gateway/gateway_config.h"

#include <algorithm>

#include "rcs/node/params/vehicle_tables.h"

namespace rcs::gateway {
namespace {

// The mission runs once a second.
constexpr Duration kMissionResend = from_seconds(1.5);
constexpr int kMissionSends = 4;
constexpr Duration kMissionSilence = from_seconds(3.0);

void read_nodes(ParamTable* table, GatewayConfig* c) {
  table->get("nodes", &c->nodes,
             "Nodes whose status is published as NodeStatus, besides the gateway's own.");
  const bool good = c->nodes.size() <= 16 &&
                    std::all_of(c->nodes.begin(), c->nodes.end(),
                                [](const std::string& n) { return is_name(n) && n != "gateway"; });
  if (!good) table->fail("nodes", "must be at most 16 names of other nodes, e.g. [\"sp\", \"wm\"]");
}

void read_limits(ParamTable table, Limits* p) {
  table.get("max_waypoints", &p->max_waypoints, {1, 256},
            "Largest number of waypoints of a command; a command with more is rejected.");
  table.get_ms("min_valid_for_ms", &p->min_valid_for, {200, 60000},
               "Shortest validity of an operator command; a shorter one is rejected, as it could "
               "not be renewed in time.");
  table.get_ms("max_valid_for_ms", &p->max_valid_for, {200, 60000},
               "Longest validity of an operator command; it bounds how long the vehicle drives "
               "after its operator falls silent.");
  table.get("max_speed_mps", &p->max_speed_mps, {0.1, 50},
            "Largest speed at a waypoint; a command with a larger one is rejected.");
  table.get("min_radius_m", &p->min_radius_m, {0.01, 1000},
            "Smallest radius of a waypoint; a command with a smaller one is rejected.");
  table.get("max_radius_m", &p->max_radius_m, {0.01, 1000},
            "Largest radius of a waypoint; a command with a larger one is rejected.");
  table.get(
      "max_position_m", &p->max_position_m, {1, 1e6},
      "Largest coordinate of a waypoint in its frame; a command with a larger one is rejected.");
  if (p->max_valid_for < p->min_valid_for) {
    table.fail("max_valid_for_ms", "must not be less than min_valid_for_ms");
  }
  if (p->max_radius_m < p->min_radius_m) {
    table.fail("max_radius_m", "must not be less than min_radius_m");
  }
}

void read_commands(ParamTable table, ArbiterParams* p, CommandPortParams* port,
                   CommandPortParams* mission) {
  table.get_ms("refresh_ms", &p->refresh, {100, 10000},
               "Interval at which the command in force is renewed to BG.");
  table.get_ms("valid_for_ms", &p->valid_for, {200, 30000},
               "Validity of a command to BG, more than refresh_ms. Larger: the vehicle tolerates a "
               "longer silence of the gateway.");
  table.get_ms("release_patience_ms", &p->release_patience, {1000, 60000},
               "Time for BG to accept the release of an emergency stop; after it the stop is "
               "engaged again.");
  table.get_ms("bg_silence_ms", &port->silence, {100, 60000},
               "Silence of BG's status after which a command counts as failed.");
  table.get_ms("mission_silence_ms", &mission->silence, {1100, 60000},
               "Silence of the mission's status after which a task counts as failed.");
  if (p->valid_for <= p->refresh) {
    table.fail("valid_for_ms", "must be more than refresh_ms: else the vehicle stops in between");
  }
}

void read_security(const ParamFile& file, ParamTable* gateway, GatewayConfig* c) {
  gateway->get("unsecured", &c->unsecured,
               "Runs DDS without security, so that everyone on the network can command the "
               "vehicle. Required if no keys are configured.");
  ParamTable security = gateway->table("security");
  std::string directory;
  security.get("directory", &directory,
               "Folder of the DDS identity that `rcs keys` made, relative to this file. Empty: "
               "unsecured, which needs unsecured = true.");
  if (!directory.empty()) c->dds.keys = file.resolve(directory);
  if (c->unsecured && !c->dds.keys.empty()) {
    gateway->fail("unsecured", "is true, but [gateway.security] names keys: choose one");
  }
  if (!c->unsecured && c->dds.keys.empty()) {
    gateway->fail(
        "unsecured",
        "is false, and [gateway.security] directory names no keys: make them with `rcs "
        "keys`, or set unsecured = true to let everyone on the network command the vehicle");
  }
}

}  // namespace

Result<GatewayConfig> load_gateway_config(const ParamFile& file) {
  GatewayConfig c;
  ParamTable vehicle = file.root().table("vehicle");
  vehicle.get("name", &c.vehicle,
              "Name of the vehicle: its DDS partition and the addressee of commands. 1 to 32 "
              "letters, digits, '_' or '-'.");
  if (!is_name(c.vehicle)) {
    vehicle.fail("name",
                 "must be 1 to 32 letters, digits, '_' or '-': it identifies the vehicle in DDS");
  }

  ParamTable gateway = file.root().table("gateway");
  gateway.get_ms("budget_ms", &c.info.budget, {1, 1000},
                 "Deadline of a cycle after its wakeup; a cycle that ends later is an overrun.");
  gateway.get_ms("nominal_compute_ms", &c.info.nominal_compute, {0, 1000},
                 "Compute time by which a replay delays the output of a cycle.");
  gateway.get_ms(
      "period_ms", &c.period, {10, 1000},
      "Period of the gateway's cycle, in which it reads operator commands and publishes.");
  gateway.get_ms("state_period_ms", &c.state_period, {10, 10000},
                 "Period of the published VehicleState.");
  gateway.get_ms(
      "state_max_age_ms", &c.state_max_age, {100, 60000},
      "Largest age of the navigation state; VehicleState is not published from an older one.");
  gateway.get_ms(
      "status_period_ms", &c.node_status.period, {100, 60000},
      "Interval of a node's NodeStatus while it does not change; a change is published sooner.");
  gateway.get_ms("node_silence_ms", &c.node_status.silence, {100, 60000},
                 "Silence after which a node is published as not alive.");
  read_nodes(&gateway, &c);
  dds::read_network(&gateway, &c.dds.network, "DDS domain of the gateway.");
  gateway.get(
      "tasks", &c.arbiter.limits.tasks,
      "Commands of operators are tasks of the node mission, which must run, and not commands "
      "of BG. Emergency stops are BG's in both cases.");
  read_limits(gateway.table("limits"), &c.arbiter.limits);
  c.mission_port = {kMissionResend, kMissionSends, kMissionSilence};
  read_commands(gateway.table("commands"), &c.arbiter, &c.port, &c.mission_port);
  read_security(file, &gateway, &c);

  if (Outcome read_all = file.finish(tables_but({"gateway"})); !read_all) return read_all.error();
  return c;
}

}  // namespace rcs::gateway

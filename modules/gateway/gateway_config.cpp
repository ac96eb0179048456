#include "modules/gateway/gateway_config.h"

#include <algorithm>
#include <string_view>

#include "rcs/node/params/vehicle_tables.h"

namespace rcs::gateway {
namespace {

/// What names of interfaces and hosts are made of; they go into DDS's configuration as they are.
bool is_host_text(std::string_view text) {
  constexpr std::string_view kAllowed =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.:";
  return !text.empty() && text.find_first_not_of(kAllowed) == std::string_view::npos;
}

void read_dds(ParamTable* table, DdsParams* p) {
  table->get("domain", &p->domain, {0, 230});
  table->get("interface", &p->interface);
  table->get("multicast", &p->multicast);
  table->get("peers", &p->peers);
  if (!is_host_text(p->interface)) {
    table->fail("interface", "must be the name of a network interface, e.g. \"lo\"");
  }
  if (!std::all_of(p->peers.begin(), p->peers.end(), is_host_text)) {
    table->fail("peers", "must be hosts, e.g. [\"127.0.0.1\", \"10.0.0.2\"]");
  }
}

void read_nodes(ParamTable* table, GatewayConfig* c) {
  table->get("nodes", &c->nodes);
  const bool good = c->nodes.size() <= 16 &&
                    std::all_of(c->nodes.begin(), c->nodes.end(),
                                [](const std::string& n) { return is_name(n) && n != "gateway"; });
  if (!good) table->fail("nodes", "must be at most 16 names of other nodes, e.g. [\"sp\", \"wm\"]");
}

void read_limits(ParamTable table, Limits* p) {
  table.get("max_waypoints", &p->max_waypoints, {1, 256});
  table.get_ms("min_valid_for_ms", &p->min_valid_for, {200, 60000});
  table.get_ms("max_valid_for_ms", &p->max_valid_for, {200, 60000});
  table.get("max_speed_mps", &p->max_speed_mps, {0.1, 50});
  table.get("min_radius_m", &p->min_radius_m, {0.01, 1000});
  table.get("max_radius_m", &p->max_radius_m, {0.01, 1000});
  table.get("max_position_m", &p->max_position_m, {1, 1e6});
  if (p->max_valid_for < p->min_valid_for) {
    table.fail("max_valid_for_ms", "must not be less than min_valid_for_ms");
  }
  if (p->max_radius_m < p->min_radius_m) {
    table.fail("max_radius_m", "must not be less than min_radius_m");
  }
}

void read_commands(ParamTable table, DeskParams* p, CommandPortParams* port) {
  table.get_ms("refresh_ms", &p->refresh, {100, 10000});
  table.get_ms("valid_for_ms", &p->valid_for, {200, 30000});
  table.get_ms("release_patience_ms", &p->release_patience, {1000, 60000});
  table.get_ms("bg_silence_ms", &port->silence, {100, 60000});
  if (p->valid_for <= p->refresh) {
    table.fail("valid_for_ms", "must be more than refresh_ms: else the vehicle stops in between");
  }
}

void read_security(const ParamFile& file, ParamTable* gateway, GatewayConfig* c) {
  gateway->get("plain", &c->plain);
  ParamTable security = gateway->table("security");
  std::string directory;
  security.get("directory", &directory);
  if (!directory.empty()) c->dds.keys = file.resolve(directory);
  if (c->plain && !c->dds.keys.empty()) {
    gateway->fail("plain", "is true, but [gateway.security] names keys: choose one");
  }
  if (!c->plain && c->dds.keys.empty()) {
    gateway->fail("plain",
                  "is false, and [gateway.security] directory names no keys: make them by `rcs "
                  "keys`, or say plain = true to let everyone on the network command the vehicle");
  }
}

}  // namespace

Result<GatewayConfig> load_gateway_config(const ParamFile& file) {
  GatewayConfig c;
  ParamTable vehicle = file.root().table("vehicle");
  vehicle.get("name", &c.vehicle);
  if (!is_name(c.vehicle)) {
    vehicle.fail("name", "must be 1 to 32 letters, digits, '_' or '-': DDS tells vehicles by it");
  }

  ParamTable gateway = file.root().table("gateway");
  gateway.get_ms("budget_ms", &c.info.budget, {1, 1000});
  gateway.get_ms("nominal_compute_ms", &c.info.nominal_compute, {0, 1000});
  gateway.get_ms("period_ms", &c.period, {10, 1000});
  gateway.get_ms("state_period_ms", &c.state_period, {10, 10000});
  gateway.get_ms("state_max_age_ms", &c.state_max_age, {100, 60000});
  gateway.get_ms("status_period_ms", &c.board.period, {100, 60000});
  gateway.get_ms("node_silence_ms", &c.board.silence, {100, 60000});
  read_nodes(&gateway, &c);
  read_dds(&gateway, &c.dds);
  read_limits(gateway.table("limits"), &c.desk.limits);
  read_commands(gateway.table("commands"), &c.desk, &c.port);
  read_security(file, &gateway, &c);

  if (Outcome read_all = file.finish(tables_but({"gateway"})); !read_all) return read_all.error();
  return c;
}

}  // namespace rcs::gateway

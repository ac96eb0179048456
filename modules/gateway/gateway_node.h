#pragma once
// The message shell of the gateway: publishes the state of the vehicle, receives commands of
// operators.

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "modules/gateway/dds_link.h"
#include "modules/gateway/gateway_config.h"
#include "modules/gateway/identity_node.h"
#include "modules/gateway/operator_stops.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/command_port.h"
#include "rcs/node/report.h"

namespace rcs::gateway {

class GatewayNode final : public Node {
 public:
  GatewayNode(const GatewayConfig& config, std::unique_ptr<DdsLink> dds, Bus* bus,
              IdentityReport::WallClock wall_clock);

  [[nodiscard]] const NodeInfo& info() const override { return config_.info; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  void run(const Cycle& cycle) override;
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override;
  [[nodiscard]] std::int64_t missed_cycles() const override { return clock_.missed(); }
  [[nodiscard]] std::string_view note() const override;

 private:
  struct NodeInbox {
    NodeInbox(Bus* bus, std::string_view node);
    Inbox<cycle_t> cycles;
    Inbox<process_t> processes;
  };

  void report_start(Stamp now);
  void take_nodes(Stamp now);
  void take_node(std::size_t i, Stamp now);
  /// State and reason of a node that has a superior, from its status.
  void take_status(std::size_t i, const CommandPort& port, std::int64_t* received, Stamp now);
  void take_stops(Stamp now);
  void take_commands(Stamp now);
  void refuse(Refusal refusal, std::string_view topic, std::string_view operator_id,
              std::int64_t command_id, Stamp now);
  void report_operator(Stamp now);
  void adopt_stops(Stamp now);
  /// BG lists a stop of this operator; after its first status.
  [[nodiscard]] bool is_listed_of(std::string_view operator_id) const;
  /// Sends a command to BG, or to the mission if it is a task.
  void send(const Command& command, Stamp now);
  void report_phase(Stamp now);
  void send_state(Stamp now);
  void describe_self(Stamp now);
  void send_status(Stamp now);

  GatewayConfig config_;
  PeriodicClock clock_;
  PeriodicClock state_clock_;
  std::unique_ptr<DdsLink> dds_;

  Inbox<nav_state_t> nav_states_;
  std::deque<NodeInbox> node_inboxes_;  // in the order of table_
  CommandPort port_;                    // to BG
  std::optional<CommandPort> mission_;  // for tasks
  Report report_;

  NodeStatusTable table_;  // the last row is the gateway itself
  CommandArbiter arbiter_;
  std::int64_t refused_ = 0;  // so far
  std::string last_refusal_;
  std::string failure_;           // reason reported by BG
  std::int64_t bg_received_ = 0;  // messages of BG so far
  std::int64_t mission_received_ = 0;
  bool started_ = false;  // the start has been reported
  Stamp started_at_;
  std::optional<IdentityReport> identity_;  // empty: unsecured
  OperatorStops stops_;
  bool adopted_ = false;  // the stops of former processes of the gateway
  CommandArbiter::Phase reported_phase_ = CommandArbiter::Phase::kIdle;
  std::int64_t reported_id_ = 0;
  std::int64_t reported_failures_ = 0;

  nav_state_t nav_state_{};
  Stamp nav_arrival_ = Stamp::min();
  rcs_VehicleState state_{};
  rcs_NodeStatus status_{};
};

[[nodiscard]] Result<std::unique_ptr<Node>> make_gateway_node(const ParamFile& file, Bus* bus);

}  // namespace rcs::gateway

#pragma once
// The node of the bridge: one cycle for both directions. Live only, because DDS is.

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "modules/ros2_bridge/dds_link.h"
#include "modules/ros2_bridge/input_gate.h"
#include "modules/ros2_bridge/input_node.h"
#include "modules/ros2_bridge/output_node.h"
#include "modules/ros2_bridge/ros2_bridge_config.h"
#include "rcs/node/report.h"

namespace rcs::ros2_bridge {

class Ros2BridgeNode final : public Node {
 public:
  /// UTC in microseconds since 1970.
  using UtcClock = std::function<std::int64_t()>;

  static Result<std::unique_ptr<Node>> make(const Ros2BridgeConfig& config, Bus* bus, UtcClock utc);

  [[nodiscard]] const NodeInfo& info() const override { return config_.info; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  void run(const Cycle& cycle) override;
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {}; }
  [[nodiscard]] std::int64_t missed_cycles() const override { return clock_.missed(); }

 private:
  Ros2BridgeNode(const Ros2BridgeConfig& config, Bus* bus, UtcClock utc);
  void report_start(Stamp now);
  void read_utc(Stamp now);

  Ros2BridgeConfig config_;
  PeriodicClock clock_;
  UtcClock utc_;
  UtcOffset offset_;
  Report report_;
  BusToRos2 to_ros2_;
  Ros2ToBus to_bus_;
  std::unique_ptr<DdsLink> dds_;
  bool started_ = false;
};

[[nodiscard]] Result<std::unique_ptr<Node>> make_ros2_bridge_node(const ParamFile& file, Bus* bus);

}  // namespace rcs::ros2_bridge

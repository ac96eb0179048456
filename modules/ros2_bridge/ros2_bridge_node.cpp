#include "modules/ros2_bridge/ros2_bridge_node.h"

#include <fmt/format.h>

#include <string>
#include <utility>

#include "lcmtypes/events.h"
#include "rcs/node/budget.h"
#include "rcs/node/timeline/live_timeline.h"

namespace rcs::ros2_bridge {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);

template <class T>
std::string topics_of(const std::vector<T>& list) {
  std::string text;
  for (const T& each : list) text += (text.empty() ? "" : ", ") + each.topic;
  return text.empty() ? "nothing" : text;
}

}  // namespace

Ros2BridgeNode::Ros2BridgeNode(const Ros2BridgeConfig& config, Bus* bus, UtcClock utc)
    : config_(config),
      clock_(config.period),
      utc_(std::move(utc)),
      report_(bus, config.info.name, kReportInterval),
      to_ros2_(config, bus,
               [this](std::size_t output, const std::vector<std::uint8_t>& cdr) {
                 return dds_->write(output, cdr);
               }),
      to_bus_(config, bus) {}

Result<std::unique_ptr<Node>> Ros2BridgeNode::make(const Ros2BridgeConfig& config, Bus* bus,
                                                   UtcClock utc) {
  std::unique_ptr<Ros2BridgeNode> node(new Ros2BridgeNode(config, bus, std::move(utc)));
  Result<std::unique_ptr<DdsLink>> dds = DdsLink::open(
      config.dds, outputs_of(config.output), node->to_bus_.inputs(), config.max_sample_bytes());
  if (!dds) return dds.error();
  node->dds_ = std::move(dds).value();
  return std::unique_ptr<Node>(std::move(node));
}

void Ros2BridgeNode::run(const Cycle& cycle) {
  if (!started_) report_start(cycle.now);
  read_utc(cycle.now);
  for (std::size_t input = 0; input < to_bus_.size(); ++input) {
    dds_->take(input, [&](const DdsSample& sample) {
      to_bus_.receive(input, sample, offset_.us(), cycle.now);
    });
  }
  cycle.stages->mark("receive");
  to_ros2_.run(offset_.us(), cycle.now, &report_);
  cycle.stages->mark("send");
  if (clock_.due(cycle.now)) clock_.advance(cycle.now);
  cycle.stages->close_account();
}

void Ros2BridgeNode::report_start(Stamp now) {
  started_ = true;
  report_.publish(now, event::kRos2BridgeStarted,
                  "ROS 2 domain {} on {}: publishes {}; receives {}", config_.dds.domain,
                  config_.dds.interface, topics_of(outputs_of(config_.output)),
                  topics_of(to_bus_.inputs()));
  if (to_bus_.size() == 0) return;
  report_.publish(now, event::kRos2BridgeUnsecured,
                  "ROS 2 domain {} on {} is unsecured: every program there can publish {} to the "
                  "vehicle",
                  config_.dds.domain, config_.dds.interface, topics_of(to_bus_.inputs()));
}

void Ros2BridgeNode::read_utc(Stamp now) {
  const Duration step = offset_.add(utc_(), now);
  if (step == Duration::zero()) return;
  to_ros2_.restart_clock();
  report_.publish(now, event::kRos2BridgeClockStep,
                  "UTC of this computer stepped by {:.3f} s; stamps of ROS 2 follow it",
                  seconds(step));
}

Result<std::unique_ptr<Node>> make_ros2_bridge_node(const ParamFile& file, Bus* bus) {
  const Result<Ros2BridgeConfig> config = load_ros2_bridge_config(file);
  if (!config) return config.error();
  return Ros2BridgeNode::make(*config, bus, wall_utime);
}

}  // namespace rcs::ros2_bridge

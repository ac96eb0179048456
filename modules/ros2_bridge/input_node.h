#pragma once
// From ROS 2 to the bus: samples of the inputs of the configuration are bounded, checked and
// published as sensor messages.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "modules/ros2_bridge/input_gate.h"
#include "modules/ros2_bridge/ros2_bridge_config.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/report.h"
#include "rcs/ros2/cloud_reader.h"

namespace rcs::ros2_bridge {

class Ros2ToBus {
 public:
  struct Counts {
    std::int64_t accepted = 0;
    std::int64_t rejected = 0;  ///< for any reason
    std::int64_t flood = 0;     ///< of these because of their rate
  };

  Ros2ToBus(const Ros2BridgeConfig& config, Bus* bus);
  Ros2ToBus(const Ros2ToBus&) = delete;
  Ros2ToBus& operator=(const Ros2ToBus&) = delete;
  ~Ros2ToBus() = default;

  /// The inputs that are on, for DdsLink::open(); their order is that of the indices.
  [[nodiscard]] std::vector<DdsInput> inputs() const;
  [[nodiscard]] std::size_t size() const { return inputs_.size(); }
  [[nodiscard]] const Counts& counts(std::size_t input) const { return inputs_[input].counts; }

  /// @param utc_minus_node_us  see UtcOffset
  void receive(std::size_t input, const DdsSample& sample, std::int64_t utc_minus_node_us,
               Stamp now);

 private:
  using Handler = std::string_view (Ros2ToBus::*)(const DdsSample&);

  struct Input {
    const InputConfig* config;
    const char* type;  ///< of ROS 2
    int depth;
    Handler handler;
    InputGate gate;
    Report report;  ///< one an input, so that none suppresses another
    Counts counts{};
    std::optional<std::int64_t> last_utime{};
  };

  // Each publishes the message and returns an empty text, or returns why it is rejected.
  std::string_view on_cloud(const DdsSample& sample);
  std::string_view on_imu(const DdsSample& sample);
  std::string_view on_fix(const DdsSample& sample);
  std::string_view on_odometry(const DdsSample& sample);

  void add(const InputConfig& config, const char* type, int depth, Handler handler, Bus* bus);
  /// Sensor time of a stamp; an invalid or implausible stamp, or a wrong frame, is the reason.
  std::string_view admit(const DdsSample& sample, const ros2::msg::Time& stamp,
                         const std::string& frame_id, std::int64_t* utime);
  [[nodiscard]] std::optional<Duration> since_last(std::int64_t utime) const;
  void reject(Input* input, std::string_view reason);

  Ros2BridgeConfig config_;
  std::vector<Input> inputs_;
  Outbox<ladar_points_t> points_out_;
  Outbox<ins_t> ins_out_;
  Outbox<gps_fix_t> fix_out_;
  Outbox<odometry_t> odometry_out_;

  // Of the present call of receive().
  Input* current_ = nullptr;
  std::int64_t utc_minus_node_us_ = 0;
  Stamp now_;

  ros2::msg::PointCloud2 cloud_;
  ros2::CloudPoints points_;
  std::vector<ladar_points_t> facets_;
  std::optional<std::int64_t> next_scan_;
};

}  // namespace rcs::ros2_bridge

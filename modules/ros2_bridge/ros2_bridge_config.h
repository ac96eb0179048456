#pragma once
// Configuration of the bridge to ROS 2.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "modules/ros2_bridge/dds_topics.h"
#include "modules/ros2_bridge/input_gate.h"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/dds/network.h"
#include "rcs/node/node.h"
#include "rcs/node/params/params.h"
#include "rcs/ros2/cloud_reader.h"

namespace rcs::ros2_bridge {

/// What the clock of the sensors (sensor time) is.
enum class SensorClock {
  kMeasured,  ///< any: its offset is measured by the arrivals of sensor messages
  kUtc,       ///< UTC since 1970: stamps of ROS 2 are sensor time
  kNode       ///< node time, i.e. CLOCK_MONOTONIC of this computer
};

struct OutputConfig {
  std::vector<std::string> topics;  ///< empty: nothing is published
  std::size_t max_bytes_per_s = 2'000'000;
  Duration period = from_milliseconds(50.0);         ///< of each topic but those below
  Duration cloud_period = from_milliseconds(200.0);  ///< PointCloud2
  Duration map_period = from_milliseconds(1000.0);   ///< OccupancyGrid, GridMap
};

struct InputConfig {
  std::string topic;  ///< empty: off
  std::string frame_id;
  double max_rate_hz = 0.0;
  std::size_t max_bytes = 0;

  [[nodiscard]] bool on() const { return !topic.empty(); }
};

struct Ros2BridgeConfig {
  NodeInfo info{"ros2_bridge", from_milliseconds(20.0), from_milliseconds(1.0)};
  Duration period = from_milliseconds(10.0);
  SensorClock sensor_clock = SensorClock::kMeasured;
  dds::Network dds;
  OutputConfig output;
  StampLimits stamps;
  InputConfig cloud{"", "", 25.0, 8'000'000};
  ros2::CloudLimits cloud_limits;
  InputConfig imu{"", "", 500.0, 4096};
  Quat q_vehicle_imu = Quat::Identity();
  InputConfig fix{"", "", 20.0, 4096};
  Vec3 fix_sigma_m{5.0, 5.0, 10.0};  ///< where the covariance is unknown
  InputConfig odometry{"", "", 200.0, 4096};
  double odometry_sigma_mps = 0.2;      ///< where the variance is unknown
  int sensor_id = 0;                    ///< [ladar]
  std::optional<Pose> T_vehicle_ladar;  ///< [ladar]; nullopt: the file has no such table

  /// Largest of the inputs and outputs, with room to count and report larger ones.
  [[nodiscard]] std::size_t max_sample_bytes() const;
};

/// Reads [ros2_bridge] and what it needs of [ladar]; ignores the tables of other nodes. Without an
/// output topic and without an input it returns an error: there is nothing to do.
[[nodiscard]] Result<Ros2BridgeConfig> load_ros2_bridge_config(const ParamFile& file);

}  // namespace rcs::ros2_bridge

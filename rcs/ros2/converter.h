#pragma once
// Messages of the bus or of a log as messages of ROS 2: the table of topics, and the state that
// some of them need (scans in parts, the newest pose).

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "rcs/ros2/frames.h"
#include "rcs/ros2/nav_messages.h"
#include "rcs/ros2/point_clouds.h"
#include "rcs/ros2/schema.h"

namespace rcs::ros2 {

/// A topic whose messages have the type T.
template <class T>
struct Topic {
  using Message = T;
  const char* name;
  const char* from;  ///< channels of which it is made
};

namespace topic {
inline constexpr Topic<msg::PointCloud2> kLadarPoints{"/ladar/points",
                                                      "LADAR_POINTS, LADAR_RANGES"};
inline constexpr Topic<msg::PointCloud2> kSpPoints{"/sp/points", "SP_POINTS"};
inline constexpr Topic<msg::NavSatFix> kFix{"/gps/fix", "GPS_FIX"};
inline constexpr Topic<msg::Imu> kImu{"/ins/imu", "INS"};
inline constexpr Topic<msg::TwistWithCovarianceStamped> kTwist{"/odometry/twist", "ODOMETRY"};
inline constexpr Topic<msg::PoseWithCovarianceStamped> kPose{"/wm/pose", "WM_NAV_STATE"};
inline constexpr Topic<msg::Odometry> kOdometry{"/wm/odometry", "WM_NAV_STATE"};
inline constexpr Topic<msg::TfMessage> kTf{"/tf", "WM_NAV_STATE"};
inline constexpr Topic<msg::MarkerArray> kBounds{"/wm/bounds", "WM_INTEGRITY, WM_NAV_STATE"};
inline constexpr Topic<msg::OccupancyGrid> kOccupancy{"/wm/occupancy", "WM_MAP_PATCH"};
inline constexpr Topic<msg::GridMap> kGridMap{"/wm/grid_map", "WM_MAP_PATCH"};
inline constexpr Topic<msg::Path> kPath{"/bg/path", "BG_PLAN"};
inline constexpr Topic<msg::Log> kLog{"/rosout", "*_EVENT"};
inline constexpr Topic<msg::DiagnosticArray> kDiagnostics{"/diagnostics", "*_CYCLE, *_PROCESS"};
/// Each channel X under its own type: topic /rcs/X of type rcs_msgs/msg/T.
inline constexpr char kOriginalPrefix[] = "/rcs/";
}  // namespace topic

/// Calls visit(topic) for every Topic above.
template <class Visit>
void for_each_topic(Visit&& visit) {
  visit(topic::kLadarPoints);
  visit(topic::kSpPoints);
  visit(topic::kFix);
  visit(topic::kImu);
  visit(topic::kTwist);
  visit(topic::kPose);
  visit(topic::kOdometry);
  visit(topic::kTf);
  visit(topic::kBounds);
  visit(topic::kOccupancy);
  visit(topic::kGridMap);
  visit(topic::kPath);
  visit(topic::kLog);
  visit(topic::kDiagnostics);
}

/// Receives the messages of a Converter.
class TopicSink {
 public:
  TopicSink() = default;
  TopicSink(const TopicSink&) = delete;
  TopicSink& operator=(const TopicSink&) = delete;
  virtual ~TopicSink() = default;

  /// @param cdr  valid during the call
  virtual void publish(std::string_view topic, const Schema& schema,
                       const std::vector<std::uint8_t>& cdr) = 0;
};

struct ConverterOptions {
  bool standard = true;  ///< topics with types of ROS 2
  bool original = true;  ///< topics with our own types
  ClockOffsets clocks;
  std::optional<Pose> T_vehicle_ladar;  ///< mount of the LADAR; nullopt: unknown
  /// The points of a facet of ranges, in frame `ladar`, which needs the calibration of the LADAR.
  /// Empty, or nullopt: LADAR_RANGES gives no point cloud.
  std::function<std::optional<CloudPart>(const ladar_ranges_t&)> points_of_ranges;
};

enum class Conversion {
  kDone,
  kUnknownChannel,
  kMalformed,  ///< the bytes are not a message of the channel's type
};

class Converter {
 public:
  /// @param sink  outlives the converter
  Converter(ConverterOptions options, TopicSink* sink);

  /// Publishes what the message gives: nothing, or messages on several topics.
  Conversion convert(std::string_view channel, const std::uint8_t* data, std::size_t size);
  /// At the end of the data: publishes scans of which parts are missing.
  void finish();
  /// Live: for the messages that follow.
  void set_clocks(const ClockOffsets& clocks) { options_.clocks = clocks; }

 private:
  template <class T>
  void publish(const Topic<T>& topic, const T& message);
  template <class T>
  void publish(const Topic<T>& topic, const std::optional<T>& message) {
    if (message) publish(topic, *message);
  }
  void join(CloudJoiner* joiner, const Topic<msg::PointCloud2>& topic,
            const std::optional<CloudPart>& part);

  void map(const ladar_points_t& m);
  void map(const ladar_ranges_t& m);
  void map(const points_t& m);
  void map(const gps_fix_t& m);
  void map(const ins_t& m);
  void map(const odometry_t& m);
  void map(const nav_state_t& m);
  void map(const integrity_t& m);
  void map(const map_patch_t& m);
  void map(const plan_t& m);
  void map(const event_t& m);
  void map(const cycle_t& m);
  void map(const process_t& m);
  /// Other types have no counterpart in ROS 2.
  template <class T>
  void map(const T& /*m*/) {}

  ConverterOptions options_;
  TopicSink* sink_;
  std::vector<std::uint8_t> cdr_;
  std::string original_topic_;
  CloudJoiner ladar_{kLadarFrame};
  CloudJoiner sp_{kBaseFrame};
  std::optional<nav_state_t> nav_;  // newest
};

}  // namespace rcs::ros2

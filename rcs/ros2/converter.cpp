#include "rcs/ros2/converter.h"

#include <limits>
#include <type_traits>
#include <utility>

#include "lcmtypes/channel_types.h"
#include "rcs/cdr/cdr_message.h"
#include "rcs/ros2/sensor_messages.h"
#include "rcs/ros2/status_messages.h"
#include "rcs/ros2/terrain_messages.h"

namespace rcs::ros2 {

Converter::Converter(ConverterOptions options, TopicSink* sink)
    : options_(std::move(options)), sink_(sink) {}

Conversion Converter::convert(std::string_view channel, const std::uint8_t* data,
                              std::size_t size) {
  if (size > std::size_t{std::numeric_limits<std::int32_t>::max()}) return Conversion::kMalformed;
  bool decoded = false;
  const bool known = channel::with_type_of(channel, [&](const auto* type) {
    using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
    T message{};
    const int bytes = static_cast<int>(size);
    decoded = message.decode(data, 0, bytes) == bytes;
    if (!decoded) return;
    if (options_.original) {
      cdr::write_message(message, &cdr_);
      original_topic_ = topic::kOriginalPrefix;
      original_topic_ += channel;
      sink_->publish(original_topic_, schema_of<T>(), cdr_);
    }
    if (options_.standard) map(message);
  });
  if (!known) return Conversion::kUnknownChannel;
  return decoded ? Conversion::kDone : Conversion::kMalformed;
}

void Converter::finish() {
  publish(topic::kLadarPoints, ladar_.finish(options_.clocks));
  publish(topic::kSpPoints, sp_.finish(options_.clocks));
}

template <class T>
void Converter::publish(const Topic<T>& topic, const T& message) {
  cdr::write_message(message, &cdr_);
  sink_->publish(topic.name, schema_of<T>(), cdr_);
}

void Converter::join(CloudJoiner* joiner, const Topic<msg::PointCloud2>& topic,
                     const std::optional<CloudPart>& part) {
  if (!part) return;
  publish(topic, joiner->add(*part, options_.clocks));
  publish(topic, joiner->completed(options_.clocks));
}

void Converter::map(const ladar_points_t& m) {
  join(&ladar_, topic::kLadarPoints, to_cloud_part(m));
}

void Converter::map(const ladar_ranges_t& m) {
  if (options_.points_of_ranges) {
    join(&ladar_, topic::kLadarPoints, options_.points_of_ranges(m));
  }
}

void Converter::map(const points_t& m) { join(&sp_, topic::kSpPoints, to_cloud_part(m)); }

void Converter::map(const gps_fix_t& m) {
  publish(topic::kFix, to_nav_sat_fix(m, options_.clocks));
}

void Converter::map(const ins_t& m) { publish(topic::kImu, to_imu(m, options_.clocks)); }

void Converter::map(const odometry_t& m) { publish(topic::kTwist, to_twist(m, options_.clocks)); }

void Converter::map(const nav_state_t& m) {
  nav_ = m;
  const std::optional<NavMessages> nav = to_nav(m, options_.clocks, options_.T_vehicle_ladar);
  if (!nav) return;
  publish(topic::kTf, nav->tf);
  publish(topic::kPose, nav->pose);
  publish(topic::kOdometry, nav->odometry);
}

void Converter::map(const integrity_t& m) {
  if (nav_) publish(topic::kBounds, to_bounds(*nav_, m, options_.clocks));
}

void Converter::map(const map_patch_t& m) {
  publish(topic::kOccupancy, to_occupancy(m, options_.clocks));
  publish(topic::kGridMap, to_grid_map(m, options_.clocks));
}

void Converter::map(const plan_t& m) { publish(topic::kPath, to_path(m, options_.clocks)); }

void Converter::map(const event_t& m) { publish(topic::kLog, to_log(m, options_.clocks)); }

void Converter::map(const cycle_t& m) {
  publish(topic::kDiagnostics, to_diagnostics(m, options_.clocks));
}

void Converter::map(const process_t& m) {
  publish(topic::kDiagnostics, to_diagnostics(m, options_.clocks));
}

}  // namespace rcs::ros2

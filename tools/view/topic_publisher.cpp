#include "tools/view/topic_publisher.h"

#include <algorithm>
#include <limits>

#include "rcs/cdr/cdr_message.h"
#include "tools/mcap/ladar_facets.h"

namespace rcs::view {
namespace {

ros2::ConverterOptions options_of(bool original, const ros2::ClockOffsets& clocks,
                                  const std::optional<sp::LadarParams>& ladar) {
  ros2::ConverterOptions options;
  options.standard = !original;
  options.original = original;
  options.clocks = clocks;
  if (ladar && !original) {
    options.T_vehicle_ladar = ladar->T_vehicle_mount;
    options.points_of_ranges = mcap::FacetPoints(*ladar);
  }
  return options;
}

/// [us]; the stamp is the first field of a PointCloud2.
std::int64_t stamp_of(const std::vector<std::uint8_t>& cdr) {
  cdr::Reader reader(cdr.data(), cdr.size());
  const auto sec = reader.number<std::int32_t>();
  const auto nanosec = reader.number<std::uint32_t>();
  return std::int64_t{sec} * 1'000'000 + nanosec / 1000;
}

}  // namespace

TopicPublisher::TopicPublisher(const TopicTable* topics, const ros2::ClockOffsets& clocks,
                               const std::optional<sp::LadarParams>& ladar, Publish publish)
    : topics_(topics),
      clocks_(clocks),
      publish_(std::move(publish)),
      standard_(options_of(false, clocks, ladar), this),
      original_(options_of(true, clocks, ladar), this) {}

void TopicPublisher::add(const SourceMessage& message, ChannelSet standard, ChannelSet original) {
  const std::optional<std::size_t> channel = channel_index(message.channel);
  if (!channel) return;
  constexpr std::int64_t kMax_us = std::numeric_limits<std::int64_t>::max() / 1000;
  time_ns_ =
      static_cast<std::uint64_t>(std::clamp(message.stamp_utime, std::int64_t{0}, kMax_us)) * 1000U;
  ros2::Conversion done = ros2::Conversion::kDone;
  if ((standard & channel_bit(*channel)) != 0) {
    if (message.channel == channel::kWmNavState) {
      poses_.add_nav_state(message.data, message.size);
    }
    done = standard_.convert(message.channel, message.data, message.size);
  }
  if ((original & channel_bit(*channel)) != 0) {
    done = original_.convert(message.channel, message.data, message.size);
  }
  if (done == ros2::Conversion::kMalformed) ++malformed_;
}

void TopicPublisher::publish(std::string_view topic, const ros2::Schema& /*schema*/,
                             const std::vector<std::uint8_t>& cdr) {
  const TopicInfo* info = topics_->find(topic);
  if (info == nullptr) return;
  publish_(*info, time_ns_, std::make_shared<const std::vector<std::uint8_t>>(cdr));
  if (topic == ros2::topic::kSpPoints.name || topic == ros2::topic::kLadarPoints.name) {
    publish_scan_pose(cdr);
  }
}

void TopicPublisher::publish_scan_pose(const std::vector<std::uint8_t>& cloud) {
  const std::int64_t stamp = stamp_of(cloud);
  const std::optional<Pose> T_world_vehicle = poses_.at(stamp - clocks_.sensor_us);
  if (!T_world_vehicle) return;
  ros2::msg::PoseStamped pose;
  pose.header = {ros2::to_time(stamp), ros2::kMapFrame};
  pose.pose = ros2::to_pose(*T_world_vehicle);
  std::vector<std::uint8_t> cdr;
  cdr::write_message(pose, &cdr);
  publish_(*topics_->find(kScanPose.name), time_ns_,
           std::make_shared<const std::vector<std::uint8_t>>(std::move(cdr)));
}

}  // namespace rcs::view

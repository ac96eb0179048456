#pragma once
// Messages of a source as messages of the topics that clients subscribe to.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "modules/sp/scan/range_image.h"
#include "rcs/ros2/converter.h"
#include "tools/view/server/send_queue.h"
#include "tools/view/server/topic_table.h"
#include "tools/view/source/pose_history.h"
#include "tools/view/source/source.h"

namespace rcs::view {

/// Converts only what is wanted: a viewer without clients costs nearly no time.
class TopicPublisher final : private ros2::TopicSink {
 public:
  using Publish =
      std::function<void(const TopicInfo& topic, std::uint64_t time_ns, const Payload& payload)>;

  /// @param topics  outlives the publisher
  /// @param ladar  calibration, for points of LADAR_RANGES and the mount in /tf; nullopt: unknown
  TopicPublisher(const TopicTable* topics, const ros2::ClockOffsets& clocks,
                 const std::optional<sp::LadarParams>& ladar, Publish publish);

  void add(const SourceMessage& message, ChannelSet standard, ChannelSet original);
  /// Messages that are not of the type of their channel.
  [[nodiscard]] std::int64_t malformed() const { return malformed_; }

 private:
  void publish(std::string_view topic, const ros2::Schema& schema,
               const std::vector<std::uint8_t>& cdr) override;
  void publish_scan_pose(const std::vector<std::uint8_t>& cloud);

  const TopicTable* topics_;
  ros2::ClockOffsets clocks_;
  Publish publish_;
  ros2::Converter standard_;
  ros2::Converter original_;
  PoseHistory poses_{2'000'000};
  std::uint64_t time_ns_ = 0;
  std::int64_t malformed_ = 0;
};

}  // namespace rcs::view

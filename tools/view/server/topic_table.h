#pragma once
// The topics that the viewer offers: those of rcs/ros2, and the pose of the newest scan.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/ros2/converter.h"
#include "rcs/ros2/schema.h"

namespace rcs::view {

/// A set of channels: bit i is channel::kAll[i].
using ChannelSet = std::uint64_t;

/// The index in channel::kAll; nullopt: not a channel of this system.
[[nodiscard]] std::optional<std::size_t> channel_index(std::string_view channel);
[[nodiscard]] constexpr ChannelSet channel_bit(std::size_t index) { return ChannelSet{1} << index; }
/// @param patterns  names, and "*_EVENT" for all names with this end; separated by ", "
[[nodiscard]] ChannelSet channels_of(std::string_view patterns);

/// T_map_base_link at the stamp of the newest /sp/points or /ladar/points, for a client that sees
/// only the newest message of each topic.
inline constexpr ros2::Topic<ros2::msg::PoseStamped> kScanPose{
    "/view/scan_pose", "SP_POINTS, LADAR_POINTS, LADAR_RANGES, WM_NAV_STATE"};

struct TopicInfo {
  std::uint32_t id = 0;  ///< from 1
  std::string name;
  const ros2::Schema* schema = nullptr;
  ChannelSet sources = 0;
  bool original = false;  ///< a channel under its own type
};

/// The ids depend on the program alone.
class TopicTable {
 public:
  TopicTable();

  [[nodiscard]] const std::vector<TopicInfo>& topics() const { return topics_; }
  /// nullptr: unknown
  [[nodiscard]] const TopicInfo* find(std::uint32_t id) const;
  [[nodiscard]] const TopicInfo* find(std::string_view name) const;

 private:
  void add(std::string name, const ros2::Schema& schema, ChannelSet sources, bool original);

  std::vector<TopicInfo> topics_;  // topics_[id - 1]
};

}  // namespace rcs::view

#include "tools/view/server/topic_table.h"

#include <algorithm>
#include <iterator>
#include <type_traits>
#include <utility>

#include "lcmtypes/channel_types.h"
#include "rcs/node/bus/udpm_receiver.h"

namespace rcs::view {

static_assert(std::size(channel::kAll) <= 64, "a ChannelSet has a bit for each channel");

std::optional<std::size_t> channel_index(std::string_view channel) {
  const auto* const at =
      std::find_if(std::begin(channel::kAll), std::end(channel::kAll),
                   [&](const channel::Info& info) { return channel == info.name; });
  if (at == std::end(channel::kAll)) return std::nullopt;
  return static_cast<std::size_t>(at - std::begin(channel::kAll));
}

ChannelSet channels_of(std::string_view patterns) {
  ChannelSet set = 0;
  while (!patterns.empty()) {
    const std::string_view pattern = patterns.substr(0, patterns.find(','));
    patterns.remove_prefix(std::min(patterns.size(), pattern.size() + 2));
    for (std::size_t i = 0; i < std::size(channel::kAll); ++i) {
      if (matches(pattern, channel::kAll[i].name)) set |= channel_bit(i);
    }
  }
  return set;
}

namespace {

template <class T>
const ros2::Schema& schema_of(const ros2::Topic<T>& /*topic*/) {
  return ros2::schema_of<T>();
}

}  // namespace

TopicTable::TopicTable() {
  const auto add_standard = [this](const auto& topic) {
    add(topic.name, schema_of(topic), channels_of(topic.from), false);
  };
  ros2::for_each_topic(add_standard);
  add_standard(kScanPose);
  for (std::size_t i = 0; i < std::size(channel::kAll); ++i) {
    const std::string name = channel::kAll[i].name;
    channel::with_type_of(name, [&](const auto* type) {
      using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
      add(ros2::topic::kOriginalPrefix + name, ros2::schema_of<T>(), channel_bit(i), true);
    });
  }
}

void TopicTable::add(std::string name, const ros2::Schema& schema, ChannelSet sources,
                     bool original) {
  const auto id = static_cast<std::uint32_t>(topics_.size() + 1);
  topics_.push_back({id, std::move(name), &schema, sources, original});
}

const TopicInfo* TopicTable::find(std::uint32_t id) const {
  return id >= 1 && id <= topics_.size() ? &topics_[id - 1] : nullptr;
}

const TopicInfo* TopicTable::find(std::string_view name) const {
  const auto at = std::find_if(topics_.begin(), topics_.end(),
                               [&](const TopicInfo& topic) { return topic.name == name; });
  return at == topics_.end() ? nullptr : &*at;
}

}  // namespace rcs::view

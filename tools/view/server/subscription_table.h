#pragma once
// The subscriptions of one client.

#include <cstddef>
#include <cstdint>
#include <map>

#include "tools/view/server/topic_table.h"

namespace rcs::view {

class SubscriptionTable {
 public:
  static constexpr std::size_t kMax = 1000;

  enum class Added { kDone, kUnknownTopic, kUsedId, kTooMany };

  /// @param topics  outlives the table
  explicit SubscriptionTable(const TopicTable* topics) : topics_(topics) {}

  /// @param id  chosen by the client
  [[nodiscard]] Added add(std::uint32_t id, std::uint32_t topic);
  /// @return false: the id is unknown
  [[nodiscard]] bool remove(std::uint32_t id) { return by_id_.erase(id) == 1; }

  [[nodiscard]] bool empty() const { return by_id_.empty(); }
  [[nodiscard]] bool has(std::uint32_t topic) const;
  /// Calls visit(id of the subscription) for each subscription of the topic.
  template <class Visit>
  void for_each_of(std::uint32_t topic, Visit&& visit) const {
    for (const auto& [id, subscribed] : by_id_) {
      if (subscribed == topic) visit(id);
    }
  }
  /// The channels that the subscribed topics are made of.
  /// @param original  of topics with our own types, else of topics with types of ROS 2
  [[nodiscard]] ChannelSet sources(bool original) const;

 private:
  const TopicTable* topics_;
  std::map<std::uint32_t, std::uint32_t> by_id_;  // subscription -> topic
};

}  // namespace rcs::view

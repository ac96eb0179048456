#include "tools/view/server/subscription_table.h"

#include <algorithm>

namespace rcs::view {

SubscriptionTable::Added SubscriptionTable::add(std::uint32_t id, std::uint32_t topic) {
  if (topics_->find(topic) == nullptr) return Added::kUnknownTopic;
  if (by_id_.count(id) > 0) return Added::kUsedId;
  if (by_id_.size() >= kMax) return Added::kTooMany;
  by_id_.emplace(id, topic);
  return Added::kDone;
}

bool SubscriptionTable::has(std::uint32_t topic) const {
  return std::any_of(by_id_.begin(), by_id_.end(),
                     [topic](const auto& entry) { return entry.second == topic; });
}

ChannelSet SubscriptionTable::sources(bool original) const {
  ChannelSet set = 0;
  for (const auto& [id, topic] : by_id_) {
    const TopicInfo* info = topics_->find(topic);
    if (info->original == original) set |= info->sources;
  }
  return set;
}

}  // namespace rcs::view

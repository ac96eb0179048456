// Topics, subscriptions, and what waits for one client.

#include <gmock/gmock.h>

#include <memory>
#include <set>

#include "lcmtypes/channels.h"
#include "tools/view/server/send_queue.h"
#include "tools/view/server/subscription_table.h"
#include "tools/view/server/topic_table.h"

namespace rcs::view {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Payload payload(std::size_t size, std::uint8_t value = 0) {
  return std::make_shared<const std::vector<std::uint8_t>>(size, value);
}

TEST(TopicTable, HasEveryChannelUnderItsOwnTypeAndEveryTopicOfRos2) {
  const TopicTable topics;
  std::set<std::string> names;
  for (const TopicInfo& topic : topics.topics()) {
    EXPECT_TRUE(names.insert(topic.name).second) << topic.name;
    EXPECT_EQ(topics.find(topic.id), &topic);
    EXPECT_EQ(topics.find(topic.name), &topic);
    EXPECT_NE(topic.sources, 0U) << topic.name;
    EXPECT_FALSE(topic.schema->text.empty()) << topic.name;
  }
  for (const channel::Info& c : channel::kAll) {
    EXPECT_EQ(names.count(std::string("/rcs/") + c.name), 1U) << c.name;
  }
  EXPECT_EQ(names.count("/tf"), 1U);
  EXPECT_EQ(names.count("/view/scan_pose"), 1U);
  EXPECT_EQ(topics.find(0U), nullptr);
  EXPECT_EQ(topics.find("/nothing"), nullptr);
}

TEST(TopicTable, PatternsNameChannels) {
  const auto bit = [](const char* name) { return channel_bit(*channel_index(name)); };
  EXPECT_EQ(channels_of("GPS_FIX"), bit("GPS_FIX"));
  EXPECT_EQ(channels_of("WM_INTEGRITY, WM_NAV_STATE"), bit("WM_INTEGRITY") | bit("WM_NAV_STATE"));
  EXPECT_EQ(channels_of("*_CYCLE"), bit("SP_CYCLE") | bit("WM_CYCLE") | bit("BG_CYCLE") |
                                        bit("MISSION_CYCLE") | bit("GATEWAY_CYCLE") |
                                        bit("ROS2_BRIDGE_CYCLE"));
  EXPECT_EQ(channels_of("NOT_A_CHANNEL"), 0U);
}

TEST(SubscriptionTable, AddsAndRemovesByTheIdOfTheClient) {
  const TopicTable topics;
  SubscriptionTable table(&topics);
  const std::uint32_t tf = topics.find("/tf")->id;
  const std::uint32_t nav = topics.find("/rcs/WM_NAV_STATE")->id;
  using Added = SubscriptionTable::Added;
  EXPECT_EQ(table.add(7, tf), Added::kDone);
  EXPECT_EQ(table.add(7, nav), Added::kUsedId);
  EXPECT_EQ(table.add(8, 100'000), Added::kUnknownTopic);
  EXPECT_EQ(table.add(8, tf), Added::kDone);
  EXPECT_EQ(table.add(9, nav), Added::kDone);
  std::vector<std::uint32_t> ids;
  table.for_each_of(tf, [&](std::uint32_t id) { ids.push_back(id); });
  EXPECT_THAT(ids, ElementsAre(7, 8));
  EXPECT_TRUE(table.remove(7));
  EXPECT_FALSE(table.remove(7));
  EXPECT_TRUE(table.has(tf));
  EXPECT_TRUE(table.remove(8));
  EXPECT_FALSE(table.has(tf));
}

TEST(SubscriptionTable, NeedsTheChannelsOfItsTopicsOnly) {
  const TopicTable topics;
  SubscriptionTable table(&topics);
  EXPECT_EQ(table.sources(false) | table.sources(true), 0U);
  (void)table.add(1, topics.find("/wm/bounds")->id);
  (void)table.add(2, topics.find("/rcs/GPS_FIX")->id);
  EXPECT_EQ(table.sources(false), channels_of("WM_INTEGRITY, WM_NAV_STATE"));
  EXPECT_EQ(table.sources(true), channels_of("GPS_FIX"));
}

TEST(SubscriptionTable, IsBounded) {
  const TopicTable topics;
  SubscriptionTable table(&topics);
  for (std::uint32_t id = 0; id < SubscriptionTable::kMax; ++id) {
    ASSERT_EQ(table.add(id, 1), SubscriptionTable::Added::kDone);
  }
  EXPECT_EQ(table.add(5000, 1), SubscriptionTable::Added::kTooMany);
}

TEST(SendQueue, KeepsTheNewestMessageOfEachSubscriptionInItsPlace) {
  SendQueue queue(1000);
  queue.push(1, 10, payload(10, 1));
  queue.push(2, 11, payload(10, 2));
  queue.push(1, 12, payload(20, 3));
  EXPECT_EQ(queue.bytes(), 30U);
  EXPECT_EQ(queue.dropped(), 1);
  const std::optional<Outgoing> first = queue.pop();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->subscription, 1U);
  EXPECT_EQ(first->time_ns, 12U);
  EXPECT_EQ(first->payload->front(), 3);
  EXPECT_EQ(queue.pop()->subscription, 2U);
  EXPECT_FALSE(queue.pop());
  EXPECT_EQ(queue.bytes(), 0U);
}

TEST(SendQueue, TextsComeFirstAndInTheirOrder) {
  SendQueue queue(1000);
  queue.push(1, 10, payload(10));
  EXPECT_TRUE(queue.push_text("a"));
  EXPECT_TRUE(queue.push_text("b"));
  EXPECT_EQ(queue.pop()->text, "a");
  EXPECT_EQ(queue.pop()->text, "b");
  EXPECT_NE(queue.pop()->payload, nullptr);
  EXPECT_TRUE(queue.empty());
}

TEST(SendQueue, NeverExceedsItsBytes) {
  SendQueue queue(100);
  for (std::uint32_t id = 0; id < 50; ++id) {
    queue.push(id, id, payload(30));
    EXPECT_LE(queue.bytes(), 100U);
  }
  EXPECT_EQ(queue.dropped(), 47);
  EXPECT_EQ(queue.pop()->subscription, 47U) << "those that waited longest were dropped";
  queue.push(99, 0, payload(101));
  EXPECT_EQ(queue.dropped(), 48) << "larger than the limit";
  EXPECT_FALSE(queue.push_text(std::string(200, 'x')));
  EXPECT_LE(queue.bytes(), 100U);
}

TEST(SendQueue, MessagesMakeRoomForTexts) {
  SendQueue queue(100);
  queue.push(1, 10, payload(60));
  EXPECT_TRUE(queue.push_text(std::string(70, 'a')));
  EXPECT_EQ(queue.bytes(), 70U);
  EXPECT_EQ(queue.dropped(), 1);
  EXPECT_FALSE(queue.push_text(std::string(40, 'b')));
  EXPECT_EQ(queue.pop()->text, std::string(70, 'a'));
  EXPECT_TRUE(queue.empty());
  EXPECT_TRUE(queue.push_text(std::string(100, 'c')));
}

TEST(SendQueue, ForgetsASubscriptionThatEnded) {
  SendQueue queue(1000);
  queue.push(1, 10, payload(10));
  queue.push(2, 10, payload(10));
  queue.forget(1);
  queue.forget(3);
  EXPECT_EQ(queue.bytes(), 10U);
  EXPECT_EQ(queue.pop()->subscription, 2U);
}

}  // namespace
}  // namespace rcs::view

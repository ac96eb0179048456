#include "rcs/node/bus/local_bus.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "lcmtypes/rcs/event_t.hpp"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"

namespace rcs {
namespace {

class Recorder final : public Receiver, public BusTap {
 public:
  void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept override {
    received.emplace_back(std::string(data, data + size), to_utime(arrival));
  }
  void on_deliver(Stamp due, std::string_view channel, const std::uint8_t*, std::size_t) override {
    tapped.emplace_back(channel, to_utime(due));
  }
  std::vector<std::pair<std::string, std::int64_t>> received;
  std::vector<std::pair<std::string, std::int64_t>> tapped;
};

class LocalBusTest : public testing::Test {
 protected:
  void publish(const std::string& channel, const std::string& text, std::int64_t due) {
    bus_.set_publish_due(from_utime(due));
    bus_.publish(channel, reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
  }
  void deliver_all() {
    while (bus_.next_due() != Stamp::max()) bus_.deliver_next(bus_.next_due());
  }
  LocalBus bus_;
  Recorder recorder_;
};

TEST_F(LocalBusTest, DeliversByDueAndThenInTheOrderOfPublication) {
  bus_.subscribe("A", &recorder_);
  bus_.subscribe("B", &recorder_);
  publish("A", "late", 30);
  publish("B", "first", 10);
  publish("A", "second", 10);
  publish("B", "third", 10);
  publish("A", "middle", 20);
  deliver_all();
  const std::vector<std::pair<std::string, std::int64_t>> expected{
      {"first", 10}, {"second", 10}, {"third", 10}, {"middle", 20}, {"late", 30}};
  EXPECT_EQ(recorder_.received, expected);
}

TEST_F(LocalBusTest, AllReceiversOfAChannelAndNoOthersGetAMessage) {
  Recorder other;
  Recorder stranger;
  bus_.subscribe("A", &recorder_);
  bus_.subscribe("A", &other);
  bus_.subscribe("AB", &stranger);
  publish("A", "x", 1);
  deliver_all();
  EXPECT_EQ(recorder_.received.size(), 1U);
  EXPECT_EQ(other.received.size(), 1U);
  EXPECT_TRUE(stranger.received.empty());
}

TEST_F(LocalBusTest, TheTapGetsEveryMessageAtItsDueTimeEvenWithoutReceivers) {
  bus_.set_tap(&recorder_);
  publish("LATER", "x", 20);
  publish("SOONER", "x", 10);
  deliver_all();
  bus_.deliver("OUTSIDE", nullptr, 0, from_utime(30));
  const std::vector<std::pair<std::string, std::int64_t>> expected{
      {"SOONER", 10}, {"LATER", 20}, {"OUTSIDE", 30}};
  EXPECT_EQ(recorder_.tapped, expected);
}

TEST_F(LocalBusTest, EveryMessageHasTheIdsOfItsPublisher) {
  bus_.set_publisher({id_of("a log"), id_of("wm")});
  Outbox<event_t> wm(&bus_, "WM_EVENT");
  bus_.set_publisher({id_of("a log"), id_of("sp")});
  Outbox<event_t> sp(&bus_, "SP_EVENT");
  Inbox<event_t> from_wm(&bus_, "WM_EVENT", 4);
  Inbox<event_t> from_sp(&bus_, "SP_EVENT", 4);
  event_t m{};
  wm.publish(&m);
  sp.publish(&m);
  deliver_all();
  EXPECT_EQ(from_wm.front()->run_id, id_of("a log"));
  EXPECT_EQ(from_sp.front()->run_id, from_wm.front()->run_id);
  EXPECT_NE(from_sp.front()->publisher_id, from_wm.front()->publisher_id);
  EXPECT_GT(id_of("a log"), 0);
  EXPECT_NE(id_of("a log"), id_of("another"));
}

TEST_F(LocalBusTest, AReceiverMayPublish) {
  struct Forward final : Receiver {
    explicit Forward(LocalBus* b) : bus(b) {}
    void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept override {
      bus->set_publish_due(arrival + Duration(5));
      bus->publish("NEW_CHANNEL", data, size);
    }
    LocalBus* bus;
  } forward(&bus_);
  bus_.subscribe("A", &forward);
  bus_.subscribe("NEW_CHANNEL", &recorder_);
  publish("A", "x", 10);
  deliver_all();
  ASSERT_EQ(recorder_.received.size(), 1U);
  EXPECT_EQ(recorder_.received[0].second, 15);
}

}  // namespace
}  // namespace rcs

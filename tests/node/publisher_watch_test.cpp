// Which events the rejection of a second publisher causes.
#include "rcs/node/process/publisher_watch.h"

#include <gtest/gtest.h>

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/events.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/node/bus/local_bus.h"

namespace rcs {
namespace {

TEST(PublisherWatch, NamesEveryStrangerAtOnce) {
  LocalBus bus;
  bus.set_publisher({1, 10, 0});
  Inbox<nav_state_t> states(&bus, channel::kWmNavState, 4, ChannelOwner::Rule::kOneOfTheRun);
  Inbox<event_t> events(&bus, "BG_EVENT", 64);
  PublisherWatch watch(&bus, "bg", {&states});
  std::set<std::string> named;
  int published = 0;
  const auto until = [&](double from_s, double to_s, std::int64_t stranger) {
    for (double t = from_s; t < to_s; t += 0.02) {
      const Stamp now = Stamp() + from_seconds(100.0 + t);
      nav_state_t m{};
      m.run_id = 2;
      m.publisher_id = stranger;
      m.utime = to_utime(now);
      std::vector<std::uint8_t> bytes(static_cast<std::size_t>(m.getEncodedSize()));
      m.encode(bytes.data(), 0, m.getEncodedSize());
      bus.publish(channel::kWmNavState, bytes.data(), bytes.size());
      while (bus.next_due() != Stamp::max()) bus.deliver_next(now);
      Cycle cycle;
      cycle.now = cycle.wakeup = now;
      watch.run(cycle);
      while (bus.next_due() != Stamp::max()) bus.deliver_next(now);
      for (; !events.empty(); events.pop()) {
        ++published;
        const std::string& text = events.front()->text;
        named.insert(
            text.substr(text.find("publisher "), text.find(" (run") - text.find("publisher ")));
      }
    }
  };
  until(0.0, 1.0, 0xa1);
  EXPECT_EQ(named, std::set<std::string>{"publisher a1"});
  until(1.0, 1.1, 0xa2);
  EXPECT_EQ(named.size(), 2U) << "within five seconds of the first one";
  until(1.1, 2.0, 0xa1);
  EXPECT_EQ(published, 2) << "each at most every five seconds";
  for (int k = 0; k < 1000; ++k) until(2.0 + 0.02 * k, 2.01 + 0.02 * k, 1000 + k);
  EXPECT_LT(published, 30) << "ever new ones are no flood";
}

class WatchedChannel : public testing::Test {
 protected:
  WatchedChannel() {
    bus_.set_publisher({0x1b, 10, 0});
    states_.emplace(&bus_, channel::kWmNavState, 4, ChannelOwner::Rule::kOneOfTheRun);
    events_.emplace(&bus_, "BG_EVENT", 64);
    watch_.emplace(&bus_, "bg", std::vector<const InboxBase*>{&*states_});
  }

  /// Sends a message. @return what the watch reports then
  std::vector<event_t> send(const Publisher& from, double at_s) {
    const Stamp now = Stamp() + from_seconds(100.0 + at_s);
    nav_state_t m{};
    m.run_id = from.run_id;
    m.publisher_id = from.publisher_id;
    m.seq = ++seq_;
    m.utime = to_utime(now);
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(m.getEncodedSize()));
    m.encode(bytes.data(), 0, m.getEncodedSize());
    states_->receive(bytes.data(), bytes.size(), now);
    Cycle cycle;
    cycle.now = cycle.wakeup = now;
    watch_->run(cycle);
    while (bus_.next_due() != Stamp::max()) bus_.deliver_next(now);
    std::vector<event_t> reported;
    for (; !events_->empty(); events_->pop()) reported.push_back(*events_->front());
    return reported;
  }

  LocalBus bus_;
  std::optional<Inbox<nav_state_t>> states_;
  std::optional<Inbox<event_t>> events_;
  std::optional<PublisherWatch> watch_;
  std::int64_t seq_ = 0;
};

TEST_F(WatchedChannel, TheOwnerOrTheRunIsNamed) {
  const std::vector<event_t> without = send({2, 0xa1, 0}, 0.0);
  ASSERT_EQ(without.size(), 1U);
  EXPECT_EQ(without[0].code, event::kPublisherRejected.code);
  EXPECT_EQ(
      without[0].text,
      "WM_NAV_STATE: messages of publisher a1 (run 2) rejected, 1 so far; the channel belongs "
      "to run 1b, of which no publisher is known yet");
  EXPECT_TRUE(send({0x1b, 0xff00, 0}, 0.05).empty());
  const std::vector<event_t> with = send({0x1b, -1, 0}, 0.10);
  ASSERT_EQ(with.size(), 1U);
  EXPECT_EQ(with[0].text,
            "WM_NAV_STATE: messages of publisher ffffffffffffffff (run 1b) rejected, 2 so far; the "
            "channel belongs to publisher ff00 (run 1b)");
}

TEST_F(WatchedChannel, AChangeOfTheOwnerIsAnEventWithBoth) {
  EXPECT_TRUE(send({0x1b, 0xa1, 0}, 0.0).empty()) << "the first one is no change";
  for (int k = 1; k <= 40; ++k) EXPECT_TRUE(send({0x1b, 0xa1, 0}, 0.05 * k).empty());
  const std::vector<event_t> reported = send({0x1b, 0xb2, 0}, 2.25);
  ASSERT_EQ(reported.size(), 1U);
  EXPECT_EQ(reported[0].code, event::kPublisherChanged.code);
  EXPECT_EQ(
      reported[0].text,
      "WM_NAV_STATE: publisher b2 (run 1b) is accepted from now on; publisher a1 (run 1b), to "
      "which the channel belonged, was silent for 0.25 s");
  // A node that ends again and again: each change is reported.
  double t = 2.25;
  for (std::int64_t k = 1; k <= 5; ++k) {
    t += 1.5;
    EXPECT_EQ(send({0x1b, 0xb2 + k, 0}, t).size(), 1U);
  }
}

TEST_F(WatchedChannel, ARejectionCanBeReadFromItsEvent) {
  (void)send({0x1b, 0xff00, 0}, 0.0);
  const std::vector<event_t> reported = send({0x2c, 0x5b3c1d2e4f607182, 0}, 0.05);
  ASSERT_EQ(reported.size(), 1U);
  const std::optional<Rejection> rejection = rejection_of(reported[0]);
  ASSERT_TRUE(rejection);
  EXPECT_EQ(rejection->channel, "WM_NAV_STATE");
  EXPECT_EQ(rejection->publisher_id, 0x5b3c1d2e4f607182);
  EXPECT_EQ(rejection->run_id, 0x2c);
  event_t other = reported[0];
  other.code = "publisher.changed";
  EXPECT_FALSE(rejection_of(other));
  event_t damaged = reported[0];
  for (std::size_t n = damaged.text.find(" rejected") - 2; n > 0; --n) {
    damaged.text.resize(n);
    if (n <
        std::string_view("WM_NAV_STATE: messages of publisher 5b3c1d2e4f607182 (run 2").size()) {
      EXPECT_FALSE(rejection_of(damaged)) << damaged.text;
    }
  }
}

}  // namespace
}  // namespace rcs

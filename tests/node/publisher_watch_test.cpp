// Which events the rejection of a second publisher causes.
#include "rcs/node/process/publisher_watch.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
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

}  // namespace
}  // namespace rcs

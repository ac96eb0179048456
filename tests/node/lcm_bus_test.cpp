// On a private bus (with_bus.sh).
#include "rcs/node/bus/lcm_bus.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>

#include "lcmtypes/rcs/points_t.hpp"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tests/node/fixtures.h"

namespace rcs {
namespace {

using test::at_ms;

/// Delivers until `count` messages have arrived or none arrives for 2 s.
int deliver(LcmBus* bus, int count, Stamp now) {
  int delivered = 0;
  while (delivered < count) {
    pollfd p{bus->fd(), POLLIN, 0};
    if (poll(&p, 1, 2000) <= 0) break;
    if (bus->deliver_one(now)) ++delivered;
  }
  return delivered;
}

std::unique_ptr<LcmBus> open_bus() {
  Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(kDefaultLcmUrl);
  EXPECT_TRUE(bus.ok()) << bus.error().message;
  return std::move(bus).value();
}

TEST(LcmBus, MessagesAreTransportedBetweenTwoBuses) {
  const auto a = open_bus();
  const auto b = open_bus();
  Inbox<points_t> inbox(b.get(), "SP_POINTS", 200);
  Outbox<points_t> outbox(a.get(), "SP_POINTS");
  points_t cloud{};
  cloud.n = 4000;
  cloud.x_m.resize(4000, 1.0F);
  cloud.y_m.resize(4000, 2.0F);
  cloud.z_m.resize(4000, 3.0F);
  for (int i = 0; i < 50; ++i) {
    outbox.publish(&cloud);
    ASSERT_EQ(deliver(b.get(), 1, at_ms(i)), 1);
  }
  EXPECT_EQ(inbox.account().received, 50);
  EXPECT_EQ(inbox.account().gaps, 0);
  EXPECT_EQ(inbox.account().last_arrival, at_ms(49));
  EXPECT_EQ(inbox.latest()->z_m.back(), 3.0F);
}

TEST(LcmBus, ABurstWaitsInTheBusUntilTheInboxDecides) {
  // LCM's own queue of 30 would keep the oldest messages; a node needs the newest.
  const auto bus = open_bus();
  Inbox<odometry_t> inbox(bus.get(), "ODOMETRY", 4);
  Outbox<odometry_t> outbox(bus.get(), "ODOMETRY");
  odometry_t m{};
  for (int i = 0; i < 500; ++i) outbox.publish(&m);
  EXPECT_EQ(deliver(bus.get(), 500, at_ms(1)), 500);
  EXPECT_EQ(inbox.account().received, 500);
  EXPECT_EQ(inbox.account().dropped, 496);
  EXPECT_EQ(inbox.latest()->seq, 500);
}

TEST(LcmBus, GarbageOnAChannelIsCounted) {
  const auto bus = open_bus();
  Inbox<odometry_t> inbox(bus.get(), "ODOMETRY", 4);
  const std::vector<std::uint8_t> garbage(100, 0xff);
  bus->publish("ODOMETRY", garbage.data(), garbage.size());
  bus->publish("ODOMETRY", garbage.data(), 0);
  EXPECT_EQ(deliver(bus.get(), 2, at_ms(1)), 2);
  EXPECT_EQ(inbox.account().malformed, 2);
}

TEST(LcmBus, AMonitorReceivesEveryChannelWithItsNameAndTheWallClock) {
  struct Monitor final : BusMonitor {
    void receive(std::string_view channel, const std::uint8_t* data, std::size_t size,
                 std::int64_t received_utime) noexcept override {
      if (channel == "LCM_SELF_TEST") return;  // of another bus that opens
      received.emplace_back(
          std::string(channel) + ":" + std::string(reinterpret_cast<const char*>(data), size),
          received_utime);
    }
    std::vector<std::pair<std::string, std::int64_t>> received;
  } monitor;
  const auto a = open_bus();
  const auto b = open_bus();
  b->subscribe_all(&monitor);
  const std::int64_t before = wall_utime();
  const std::uint8_t bytes[] = {'x', 'y'};
  a->publish("INS", bytes, 2);
  a->publish("NOT_OF_THIS_SYSTEM", bytes, 1);
  a->publish("EMPTY", bytes, 0);
  while (monitor.received.size() < 3 && deliver(b.get(), 1, at_ms(1)) == 1) {
  }
  ASSERT_EQ(monitor.received.size(), 3U);
  EXPECT_EQ(monitor.received[0].first, "INS:xy");
  EXPECT_EQ(monitor.received[1].first, "NOT_OF_THIS_SYSTEM:x");
  EXPECT_EQ(monitor.received[2].first, "EMPTY:");
  EXPECT_GE(monitor.received[0].second, before - 1000);
  EXPECT_LE(monitor.received[2].second, wall_utime() + 1000);
}

TEST(LcmBus, NothingWaitsOnASilentBus) {
  const auto bus = open_bus();
  Inbox<odometry_t> inbox(bus.get(), "ODOMETRY", 4);
  EXPECT_FALSE(bus->deliver_one(at_ms(1)));
  EXPECT_TRUE(bus->status().ok());
}

TEST(LcmBus, TheArrivalIsTheTimeOfReceptionNotOfDelivery) {
  const auto bus = open_bus();
  Inbox<odometry_t> inbox(bus.get(), "ODOMETRY", 4);
  Outbox<odometry_t> outbox(bus.get(), "ODOMETRY");
  odometry_t m{};
  /// Arrival of a message that is sent now and delivered 50 ms later, by a clock that was set
  /// meanwhile.
  const auto arrival = [&](Stamp taken, Duration clock_was_set) {
    outbox.publish(&m);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    EXPECT_TRUE(bus->deliver_one(taken, wall_utime() + clock_was_set.count()));
    return inbox.account().last_arrival;
  };
  const Stamp first = arrival(at_ms(5000), Duration(0));
  EXPECT_LE(first, at_ms(4950));
  EXPECT_GT(first, at_ms(4500)) << "a slow machine, but not that slow";
  EXPECT_EQ(arrival(at_ms(5100), from_seconds(-3600.0)), at_ms(5100));
  EXPECT_EQ(arrival(at_ms(5200), from_seconds(3600.0)), at_ms(5100)) << "not before an earlier one";
  EXPECT_LE(arrival(at_ms(5400), Duration(0)), at_ms(5350));
}

TEST(LcmBus, ItsThreadsHandleNoSignalWhicheverOrder) {
  // StopSignals blocks signals in its own thread only: a receiver's thread that was started before
  // would end the process by Ctrl-C.
  const std::string own = std::to_string(::getpid());
  const auto blocks = [](const std::filesystem::path& thread, int signal) {
    std::ifstream status(thread / "status");
    for (std::string line; std::getline(status, line);) {
      if (line.rfind("SigBlk:", 0) != 0) continue;
      return (std::stoull(line.substr(7), nullptr, 16) >> unsigned(signal - 1) & 1U) != 0;
    }
    return false;
  };
  const auto bus = open_bus();
  EXPECT_EQ(blocks("/proc/self/task/" + own, SIGHUP), false) << "the thread that opens the bus";
  int others = 0;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
    if (thread.path().filename() == own) continue;
    ++others;
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) EXPECT_TRUE(blocks(thread.path(), signal));
  }
  EXPECT_GT(others, 0);
}

TEST(LcmBus, AnInvalidUrlIsReportedWithTheExpectedForm) {
  const auto bus = LcmBus::create("nonsense");
  ASSERT_FALSE(bus.ok());
  EXPECT_NE(bus.error().message.find("nonsense"), std::string::npos);
  EXPECT_NE(bus.error().message.find("expected udpm://"), std::string::npos);
}

}  // namespace
}  // namespace rcs

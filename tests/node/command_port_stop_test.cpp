// Emergency stops in the command protocol: no other message can prevent the execution of a stop.

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tests/node/command_sequence.h"

namespace rcs::test {
namespace {

constexpr std::int64_t kPoison = INT64_MAX;

class CommandStop : public testing::Test {
 protected:
  CommandStop() { cycle(); }

  /// Delivers the sent messages and runs a cycle of the subordinate.
  void cycle() {
    now += kStep;
    network.deliver(now, [&](const std::string& channel, const std::vector<std::uint8_t>& data) {
      operator_door.receive(channel, data);
      if (gateway) gateway->door.receive(channel, data);
      worker->door.receive(channel, data);
    });
    worker->take(now);
    StatusReport report;
    report.status = status;
    worker->report(now, report);
    port.step(now);
    if (gateway) gateway->port.step(now);
  }
  /// A well-formed command, issued now.
  [[nodiscard]] command_t command(std::int8_t kind, std::int64_t serial) const {
    command_t m{};
    m.issuer = "operator";
    m.serial = serial;
    m.kind = kind;
    m.utime = to_utime(now);
    m.valid_until_utime = to_utime(now + from_seconds(1.0));
    return m;
  }
  void send(command_t m) { commands.publish(&m); }
  [[nodiscard]] int kind() const {
    return worker->subordinate.command() == nullptr ? -1 : worker->subordinate.command()->kind;
  }
  [[nodiscard]] bool stopped_now() const {
    return worker->subordinate.is_new() && kind() == command_t::KIND_EMERGENCY_STOP;
  }

  Network network{1};
  Stamp now{std::chrono::seconds(5000)};
  std::int8_t status = status_t::STATUS_EXEC;
  Door operator_door{&network, &now};
  CommandPort port{&operator_door, kCommand, kStopChannel, kStatus, "operator", {}};
  Outbox<command_t> commands{&operator_door, kCommand};
  std::unique_ptr<Worker> worker = std::make_unique<Worker>(&network, &now);
  std::unique_ptr<Superior> gateway;
};

constexpr std::int8_t kStop = command_t::KIND_EMERGENCY_STOP;
constexpr std::int8_t kGoto = command_t::KIND_GOTO;
constexpr std::int8_t kRelease = command_t::KIND_RELEASE;

TEST_F(CommandStop, IsExecutedWithAnySerialAgeAndIssuer) {
  struct Case {
    const char* name;
    void (*spoil)(command_t* m, Stamp now);
  };
  const Case cases[] = {
      {"serial 0", [](command_t* m, Stamp) { m->serial = 0; }},
      {"serial below 0", [](command_t* m, Stamp) { m->serial = INT64_MIN; }},
      {"serial far ahead", [](command_t* m, Stamp) { m->serial = kPoison; }},
      {"an older serial", [](command_t* m, Stamp) { m->serial = 2; }},
      {"expired", [](command_t* m, Stamp) { m->valid_until_utime = 0; }},
      {"before the start", [](command_t* m, Stamp) { m->utime = 1; }},
      {"of the future", [](command_t* m, Stamp n) { m->utime = to_utime(n + from_seconds(99)); }},
      {"garbage stamps",
       [](command_t* m, Stamp) {
         m->utime = INT64_MIN;
         m->valid_until_utime = INT64_MAX;
       }},
      {"no issuer", [](command_t* m, Stamp) { m->issuer.clear(); }},
      {"a long issuer", [](command_t* m, Stamp) { m->issuer.assign(50'000, 'x'); }},
  };
  for (const Case& c : cases) {
    send(command(kGoto, to_utime(now)));
    cycle();
    ASSERT_EQ(kind(), +kGoto) << "before " << c.name;
    command_t m = command(kStop, to_utime(now));
    c.spoil(&m, now);
    send(m);
    cycle();
    EXPECT_TRUE(stopped_now()) << c.name;
    worker->release_all();
  }
}

TEST_F(CommandStop, IsExecutedWhenTheTableOfIssuersIsFull) {
  for (int k = 0; k < 30; ++k) {
    command_t m = command(kGoto, 1);
    m.issuer = "issuer " + std::to_string(k);
    send(m);
    cycle();
  }
  command_t m = command(kStop, 1);
  m.issuer = "issuer 0";
  m.utime -= 1'000'000;
  send(m);
  cycle();
  EXPECT_TRUE(stopped_now());
}

TEST_F(CommandStop, MessagesOnItsChannelAreCounted) {
  Outbox<command_t> stops{&operator_door, kStopChannel};
  for (int k = 1; k <= 30; ++k) {
    command_t m = command(kStop, k);
    m.stop_id = {k};
    m.n_stops = 1;
    stops.publish(&m);
  }
  const std::vector<std::uint8_t> garbage(20, 0xa5);
  operator_door.publish(kStopChannel, garbage.data(), garbage.size());
  cycle();
  EXPECT_EQ(worker->subordinate.stop_inbox().account().received, 30);
  EXPECT_EQ(worker->subordinate.stop_inbox().account().malformed, 1);
  EXPECT_TRUE(stopped_now());
}

// One expired message with this serial must not disable the stops of an issuer.
TEST_F(CommandStop, AnExtremeSerialDisablesNothing) {
  for (const std::int8_t kind : {kGoto, kStop, kRelease}) {
    for (const bool expired : {true, false}) {
      command_t poison = command(kind, kPoison);
      if (expired) poison.valid_until_utime = poison.utime;
      send(poison);
      cycle();
      worker->release_all();
      for (const std::int8_t next : {kGoto, kStop, kRelease}) {
        now += Duration(1);  // after the stop's arrival
        Command order;
        order.kind = next;
        port.send(order, now);
        cycle();
        EXPECT_TRUE(worker->subordinate.is_new() && this->kind() == next)
            << int{next} << " after " << int{kind} << (expired ? " expired" : "");
      }
    }
  }
  EXPECT_EQ(worker->subordinate.account().implausible, 4) << "GOTO and RELEASE, twice each";
}

TEST_F(CommandStop, RejectedSerialsDoNotAdvanceTheRecord) {
  const std::int64_t serial = to_utime(now + from_milliseconds(500.0));
  command_t expired = command(kGoto, serial);
  expired.valid_until_utime = expired.utime;
  send(expired);
  cycle();
  EXPECT_EQ(worker->subordinate.account().expired, 1);
  send(command(kGoto, serial));
  cycle();
  EXPECT_EQ(worker->subordinate.account().taken, 1) << "the serial was not recorded as used";
  // No sequence of commands advances the record beyond its bound.
  for (int k = 1; k < 100; ++k) send(command(kGoto, serial + k * 900'000));
  cycle();
  for (int k = 0; k < 25; ++k) cycle();
  send(command(kGoto, to_utime(now)));
  cycle();
  EXPECT_EQ(worker->subordinate.command()->serial, to_utime(now - kStep));
}

TEST_F(CommandStop, IsNotDisplacedByAFloodOfOtherCommands) {
  for (const bool first : {true, false}) {
    if (first) send(command(kStop, to_utime(now)));
    for (int k = 0; k < 1000; ++k) send(command(kGoto, to_utime(now) + k));
    if (!first) send(command(kStop, to_utime(now) + 5000));
    cycle();
    EXPECT_TRUE(stopped_now()) << (first ? "before the flood" : "after it");
  }
}

TEST_F(CommandStop, AReleaseIssuedBeforeTheStopArrivedDoesNotEndIt) {
  const command_t release = command(kRelease, to_utime(now));
  cycle();
  for (const bool release_first : {true, false}) {
    if (release_first) send(release);
    send(command(kStop, to_utime(now)));
    if (!release_first) send(release);
    cycle();
    EXPECT_TRUE(stopped_now());
    cycle();
    EXPECT_EQ(kind(), +kStop) << "the release must be sent again";
  }
  EXPECT_EQ(worker->subordinate.account().stale, 2);
  send(command(kRelease, to_utime(now)));
  cycle();
  EXPECT_EQ(kind(), +kRelease);
}

TEST_F(CommandStop, AReleaseGetsItsCycleWhateverFollowsIt) {
  send(command(kRelease, to_utime(now)));
  send(command(kGoto, to_utime(now) + 1));
  cycle();
  EXPECT_EQ(kind(), +kRelease);
  cycle();
  EXPECT_EQ(kind(), +kGoto);
}

TEST_F(CommandStop, IsConfirmedThoughAnotherCommandReplacesItAtOnce) {
  Command order;
  order.kind = kStop;
  port.send(order, now);
  send(command(kGoto, to_utime(now) + 1));
  cycle();
  EXPECT_FALSE(port.confirmed());
  cycle();
  cycle();
  EXPECT_EQ(kind(), +kGoto);
  EXPECT_TRUE(port.confirmed());
}

TEST_F(CommandStop, ALateCopyOfAReleasedStopIsIgnoredAndAnyOtherStopIsNot) {
  const command_t stop = command(kStop, to_utime(now));
  send(stop);
  cycle();
  send(stop);
  cycle();
  EXPECT_FALSE(worker->subordinate.is_new()) << "sent again before the echo arrived";
  EXPECT_EQ(worker->subordinate.account().repeated, 1);
  worker->release_all();
  send(stop);
  cycle();
  EXPECT_FALSE(worker->subordinate.is_new());
  for (int k = 0; k < 3; ++k) {
    command_t other = stop;
    if (k == 0) other.issuer = "gateway";
    if (k == 1) ++other.serial;
    if (k == 2) ++other.utime;
    send(stop);
    send(other);
    send(stop);  // a copy does not displace a new command
    cycle();
    EXPECT_TRUE(stopped_now()) << k;
    worker->release_all();
  }
}

TEST_F(CommandStop, TwoStopsOfOneCycleAreBothInForceAndConfirmed) {
  gateway = std::make_unique<Superior>(&network, &now, "gateway");
  Command order;
  order.kind = kStop;
  port.send(order, now);
  gateway->port.send(order, now);
  cycle();
  EXPECT_EQ(worker->latch.stops().size(), 2U);
  for (int k = 0; k < 3; ++k) cycle();
  EXPECT_TRUE(port.confirmed() && gateway->port.confirmed());
}

TEST_F(CommandStop, IsRecognizedByItsIdAlsoWithOtherSerials) {
  Command order;
  order.kind = kStop;
  order.stop = 1;
  port.send(order, now);
  for (int k = 0; k < 40; ++k) {
    cycle();
    port.send(order, now);
  }
  cycle();
  EXPECT_EQ(worker->latch.stops().size(), 1U) << "the same stop, repeated";
  worker->release_all();
  send(command(kGoto, to_utime(now)));
  cycle();
  for (int k = 0; k < 40; ++k) {
    cycle();
    port.send(order, now);
  }
  EXPECT_EQ(kind(), +kGoto) << "copies of a released stop";
  order.stop = 2;
  port.send(order, now);
  cycle();
  EXPECT_TRUE(stopped_now()) << "another stop";
}

TEST_F(CommandStop, IsReceivedOnTheChannelOfTheCommandsToo) {
  command_t m = command(kStop, 5);
  m.n_stops = 1;
  m.stop_id = {4711};
  send(m);
  cycle();
  EXPECT_TRUE(stopped_now());
  EXPECT_EQ(worker->latch.stops().at(0).id, 4711);
}

TEST_F(CommandStop, AnyNumberOfStopsInACycleIsListedOrOneWithoutAName) {
  for (int k = 1; k <= 100; ++k) {
    command_t m = command(kStop, k);
    m.n_stops = 1;
    m.stop_id = {1000 + k};
    send(m);
  }
  cycle();
  EXPECT_TRUE(stopped_now());
  ASSERT_EQ(worker->latch.stops().size(), StopLatch::kMaxStops + 1);
  EXPECT_EQ(worker->latch.stops().back().id, 0);
}

TEST_F(CommandStop, IsSentUntilItIsEchoed) {
  network.flaws.loss = 1.0;
  Command order;
  order.kind = kStop;
  port.send(order, now);
  for (int k = 0; k < 2000; ++k) cycle();  // 100 s
  EXPECT_EQ(port.progress(now).state, CommandProgress::State::kError);
  EXPECT_EQ(worker->subordinate.command(), nullptr);
  network.flaws.loss = 0.0;
  for (int k = 0; k < 6; ++k) cycle();
  EXPECT_EQ(kind(), +kStop);
  EXPECT_EQ(port.progress(now).state, CommandProgress::State::kExecuting);
}

// In force, but it would not survive a restart of the subordinate.
TEST_F(CommandStop, IsSentUntilItIsPersisted) {
  status = status_t::STATUS_ERROR;
  worker->persisted = false;
  Command order;
  order.kind = kStop;
  port.send(order, now);
  for (int k = 0; k < 100; ++k) cycle();
  EXPECT_EQ(kind(), +kStop);
  EXPECT_EQ(port.progress(now).state, CommandProgress::State::kError);
  worker = std::make_unique<Worker>(&network, &now);  // a restart
  worker->persisted = false;
  cycle();
  for (int k = 0; k < 6; ++k) cycle();
  EXPECT_EQ(kind(), +kStop) << "the stop has reached the new process";
  status = status_t::STATUS_DONE;
  cycle();
  cycle();
  EXPECT_FALSE(port.confirmed());
  worker->persisted = true;
  cycle();
  cycle();
  EXPECT_EQ(port.progress(now).state, CommandProgress::State::kDone);
}

}  // namespace
}  // namespace rcs::test

#include "rcs/node/command_port.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/node/command_sequence.h"

namespace rcs::test {
namespace {

TEST(Command, TheProtocolHoldsOverRandomSequences) {
  for (unsigned seed = 0; seed < 20'000; ++seed) {
    run_sequence(seed, 40);
    if (HasFatalFailure()) FAIL() << "seed " << seed;
  }
}

class CommandPair : public testing::Test {
 protected:
  void step() {
    now += kStep;
    network.deliver(now, [&](const std::string& channel, const std::vector<std::uint8_t>& data) {
      superior.door.receive(channel, data);
      if (worker) worker->door.receive(channel, data);
    });
    if (worker) worker->cycle(now, &network, &truth);
    network.deliver(now, [&](const std::string& channel, const std::vector<std::uint8_t>& data) {
      superior.door.receive(channel, data);
      if (worker) worker->door.receive(channel, data);
    });
    superior.port.step(now);
  }
  [[nodiscard]] CommandProgress::State state() const { return superior.port.progress(now).state; }

  Network network{1};
  Stamp now{std::chrono::seconds(5000)};
  Truth truth;
  Superior superior{&network, &now, "operator"};
  std::unique_ptr<Worker> worker = std::make_unique<Worker>(&network, &now);
};

TEST_F(CommandPair, ACommandIsSentAcceptedAndDone) {
  step();
  EXPECT_EQ(state(), CommandProgress::State::kIdle);
  superior.port.send({}, now);
  EXPECT_EQ(state(), CommandProgress::State::kSent);
  step();
  EXPECT_TRUE(worker->subordinate.is_new());
  worker->failed = false;
  worker->left = 2;
  step();
  EXPECT_FALSE(worker->subordinate.is_new());  // NEW_COMMAND for one cycle
  EXPECT_EQ(state(), CommandProgress::State::kExecuting);
  for (int k = 0; k < 3; ++k) step();
  EXPECT_EQ(state(), CommandProgress::State::kDone);
}

TEST_F(CommandPair, ALostCommandIsSentAgainAndRepetitionsAreNotExecuted) {
  step();
  network.flaws.loss = 1.0;
  superior.port.send({}, now);
  for (int k = 0; k < 3; ++k) step();
  network.flaws = {0.0, 1.0, 0};  // from now on every message arrives twice
  for (int k = 0; k < 4; ++k) step();
  EXPECT_EQ(worker->subordinate.account().taken, 1);
  EXPECT_GE(worker->subordinate.account().repeated, 1);
}

TEST_F(CommandPair, SilenceIsAnError) {
  step();
  superior.port.send({}, now);
  step();
  worker->failed = false;
  worker->left = 100;
  step();
  EXPECT_EQ(state(), CommandProgress::State::kExecuting);
  worker.reset();
  for (int k = 0; k < 12; ++k) step();
  EXPECT_EQ(state(), CommandProgress::State::kError);
  EXPECT_NE(superior.port.progress(now).reason.find("no status"), std::string::npos);
}

TEST_F(CommandPair, ARestartedSubordinateHasNoCommand) {
  step();
  superior.port.send({}, now);
  step();
  worker->left = 100;
  worker->failed = false;
  step();
  worker = std::make_unique<Worker>(&network, &now);
  step();
  step();
  EXPECT_EQ(state(), CommandProgress::State::kError);
  EXPECT_EQ(worker->subordinate.command(), nullptr);
}

TEST_F(CommandPair, ATaskContinuesAfterTheWaypointsThatAreDone) {
  step();
  Command go;
  go.kind = command_t::KIND_GOTO;
  go.waypoints.resize(3);
  go.task = 7;
  const auto done_as_told = [&] { return worker->subordinate.command()->waypoints_done; };
  const auto say = [&](int waypoints_done) {
    StatusReport report;
    report.status = status_t::STATUS_EXEC;
    report.waypoints_done = waypoints_done;
    now += kStep;
    worker->subordinate.report(now, report);
    step();
  };
  superior.port.send(go, now);
  step();
  EXPECT_EQ(done_as_told(), 0);
  say(2);
  worker = std::make_unique<Worker>(&network, &now);
  step();
  superior.port.send(go, now);
  step();
  ASSERT_NE(worker->subordinate.command(), nullptr);
  EXPECT_EQ(done_as_told(), 2);
  EXPECT_EQ(worker->subordinate.command()->task, 7);
  say(-5);  // progress that decreases or exceeds the end is ignored
  say(100);
  superior.port.send(go, now);
  step();
  EXPECT_EQ(done_as_told(), 3);
  // The same command again, or a different one.
  go.task = 8;
  superior.port.send(go, now);
  step();
  EXPECT_EQ(done_as_told(), 0);
  say(1);
  go.task = 0;
  superior.port.send(go, now);
  step();
  EXPECT_EQ(done_as_told(), 0);
}

TEST_F(CommandPair, AnEmergencyStopGetsItsCycleWhateverFollowsIt) {
  step();
  Superior gateway(&network, &now, "gateway");
  Command stop;
  stop.kind = command_t::KIND_EMERGENCY_STOP;
  gateway.port.send(stop, now);
  Command go;
  go.kind = command_t::KIND_GOTO;
  superior.port.send(go, now);
  step();
  ASSERT_NE(worker->subordinate.command(), nullptr);
  EXPECT_EQ(worker->subordinate.command()->kind, int{command_t::KIND_EMERGENCY_STOP});
  step();
  EXPECT_EQ(worker->subordinate.command()->kind, int{command_t::KIND_GOTO});
}

TEST_F(CommandPair, AStopThatWasNeverConfirmedStopsAgainAfterTheReleaseOfAnother) {
  Superior gateway(&network, &now, "gateway");
  const auto exchange = [&] {
    now += kStep;
    const auto receive = [&](const std::string& channel, const std::vector<std::uint8_t>& data) {
      superior.door.receive(channel, data);
      worker->door.receive(channel, data);
    };
    network.deliver(now, receive);
    worker->take(now);
    StatusReport report;
    report.status = status_t::STATUS_ERROR;  // the stop cannot be persisted
    worker->report(now, report);
    network.deliver(now, receive);
    superior.port.step(now);
  };
  worker->persisted = false;
  exchange();
  Command stop;
  stop.kind = command_t::KIND_EMERGENCY_STOP;
  gateway.port.send(stop, now);
  exchange();
  const std::vector<std::int64_t> of_another = {worker->latch.stops().at(0).id};
  superior.port.send(stop, now);
  for (int k = 0; k < 3; ++k) exchange();
  ASSERT_EQ(worker->subordinate.command()->kind, int{command_t::KIND_EMERGENCY_STOP});
  EXPECT_FALSE(superior.port.confirmed());
  worker->release(of_another);
  Command go;
  go.kind = command_t::KIND_GOTO;
  gateway.port.send(go, now);
  for (int k = 0; k < 20; ++k) exchange();
  EXPECT_EQ(worker->subordinate.command()->kind, int{command_t::KIND_EMERGENCY_STOP});
  ASSERT_EQ(worker->latch.stops().size(), 1U);
  EXPECT_EQ(worker->latch.stops()[0].issuer, "operator");
}

TEST_F(CommandPair, NoNumberOfOtherCommandsDisplacesARelease) {
  step();
  Command stop;
  stop.kind = command_t::KIND_EMERGENCY_STOP;
  superior.port.send(stop, now);
  step();
  step();
  ASSERT_EQ(worker->subordinate.command()->kind, int{command_t::KIND_EMERGENCY_STOP});
  Command release;
  release.kind = command_t::KIND_RELEASE;
  release.released = superior.port.listed_stops("");
  now += from_milliseconds(1.0);  // after the arrival of the stop
  const std::int64_t serial = superior.port.send(release, now);
  Outbox<command_t> flood(&superior.door, kCommand);
  for (int k = 0; k < 200; ++k) {
    command_t m{};
    m.issuer = "flood";
    m.serial = to_utime(now) + k;
    m.utime = to_utime(now);
    m.valid_until_utime = to_utime(now + from_seconds(1.0));
    m.kind = command_t::KIND_HALT;
    flood.publish(&m);
  }
  step();
  EXPECT_EQ(worker->subordinate.command()->kind, int{command_t::KIND_RELEASE});
  EXPECT_EQ(worker->subordinate.command()->serial, serial);
}

TEST_F(CommandPair, CommandsOfAnotherStartOfTheComputerAreRejectedAndStopsAreNot) {
  step();
  Outbox<command_t> replayed(&superior.door, kCommand);
  command_t m{};
  m.issuer = "operator";
  m.boot_id = 77;
  m.serial = to_utime(now);
  m.utime = to_utime(now);
  m.valid_until_utime = to_utime(now + from_seconds(1.0));
  m.kind = command_t::KIND_GOTO;
  replayed.publish(&m);
  step();
  EXPECT_EQ(worker->subordinate.account().other_boot, 1);
  EXPECT_EQ(worker->subordinate.command(), nullptr);
  m.kind = command_t::KIND_EMERGENCY_STOP;
  replayed.publish(&m);
  step();
  ASSERT_NE(worker->subordinate.command(), nullptr);
  EXPECT_EQ(worker->subordinate.command()->kind, int{command_t::KIND_EMERGENCY_STOP});
}

TEST_F(CommandPair, ImplausibleCommandsAreRejected) {
  step();
  Outbox<command_t> hostile(&superior.door, kCommand);
  command_t m{};
  m.issuer = "nobody";
  m.serial = 5;
  m.utime = to_utime(now);
  m.valid_until_utime = to_utime(now + from_seconds(1.0));
  const auto sent = [&](command_t bad) {
    hostile.publish(&bad);
    step();
  };
  command_t bad = m;
  bad.utime = to_utime(now + from_seconds(100.0));
  sent(bad);
  bad = m;
  bad.valid_until_utime = INT64_MAX;
  sent(bad);
  bad = m;
  bad.utime = INT64_MIN;
  sent(bad);
  bad = m;
  bad.serial = -1;
  sent(bad);
  EXPECT_EQ(worker->subordinate.account().implausible, 4);
  EXPECT_EQ(worker->subordinate.account().taken, 0);
  // Any number of issuers: the record is bounded, and no old command is executed again.
  for (int k = 0; k < 30; ++k) {
    command_t other = m;
    other.utime = to_utime(now);
    other.valid_until_utime = to_utime(now + from_seconds(1.0));
    other.issuer = "issuer " + std::to_string(k);
    sent(other);
  }
  EXPECT_EQ(worker->subordinate.account().taken, 30);
  m.issuer = "issuer 0";
  sent(m);
  EXPECT_EQ(worker->subordinate.account().taken, 30);
}

}  // namespace
}  // namespace rcs::test

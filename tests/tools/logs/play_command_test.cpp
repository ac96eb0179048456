// `rcs play` on the command line, on a private bus.

#include <gmock/gmock.h>
#include <signal.h>

#include <optional>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/log/log_file.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tests/support/rcs_command.h"
#include "tools/rcs/vehicle/child_process.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;

struct Ears final : Receiver {
  void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept override {
    payloads.emplace_back(data, data + size);
    last = arrival;
  }
  std::vector<std::vector<std::uint8_t>> payloads;
  Stamp last;
};

class PlayCommand : public RcsCommand {
 protected:
  PlayCommand() {
    Result<LogWriter> log = LogWriter::create(log_);
    RCS_CHECK(log.ok());
    for (int k = 0; k <= 20; ++k) {
      const auto byte = static_cast<std::uint8_t>(k);
      for (const char* name : {channel::kIns, channel::kGpsFix, channel::kBgDrive,
                               channel::kBgCommand, channel::kWmNavState, channel::kSimTruth}) {
        const std::uint8_t bytes[] = {byte, 0xAB};
        RCS_CHECK(log->write(from_utime(1'000'000 + 100'000 * k), name, bytes, 2).ok());
      }
    }
    RCS_CHECK(log->close().ok());
    Result<std::unique_ptr<LcmBus>> bus = LcmBus::create("");
    RCS_CHECK(bus.ok());
    bus_ = std::move(bus).value();
    bus_->subscribe(channel::kIns, &ins_);
    bus_->subscribe(channel::kGpsFix, &fixes_);
    for (const char* name :
         {channel::kBgDrive, channel::kBgCommand, channel::kWmNavState, channel::kSimTruth}) {
      bus_->subscribe(name, &others_);
    }
    timeline_.emplace(bus_.get(), &stop_);
  }

  /// Runs `rcs play` and listens. @return exit status; its output is in `said_`
  int play(const std::vector<std::string>& options, bool interrupt = false,
           bool publish_too = false) {
    std::vector<std::string> arguments = {"play", log_};
    arguments.insert(arguments.end(), options.begin(), options.end());
    Result<cli::ChildProcess> child =
        cli::ChildProcess::start(variable("RCS_BIN_DIR") + "/rcs", arguments);
    RCS_CHECK(child.ok());
    std::optional<cli::Exit> exit;
    while (!exit) {
      static_cast<void>(timeline_->advance(timeline_->now() + from_seconds(0.02)));
      if (publish_too) bus_->publish(channel::kIns, kMine, sizeof kMine);
      if (interrupt && ins_.payloads.size() > 2) child->send_signal(SIGINT);
      child->read_output([this](std::string_view line) { said_ += std::string(line) + "\n"; });
      exit = child->collect();
    }
    while (timeline_->advance(timeline_->now() + from_seconds(0.1)) == Timeline::Step::kDelivered) {
    }
    child->read_output([this](std::string_view line) { said_ += std::string(line) + "\n"; });
    return exit->by_signal ? -1 : exit->code;
  }

  static constexpr std::uint8_t kMine[] = {0xCD};
  StopSignals stop_;
  std::string log_ = folder_ + "/run.log";
  Ears ins_, fixes_, others_;
  std::unique_ptr<LcmBus> bus_;
  std::optional<LiveTimeline> timeline_;
  std::string said_;
};

TEST_F(PlayCommand, PublishesOnlyTheSensorMessagesAsRecorded) {
  const Stamp begin = timeline_->now();
  EXPECT_EQ(play({"--speed", "4"}), 0) << said_;
  ASSERT_EQ(ins_.payloads.size(), 21U);
  ASSERT_EQ(fixes_.payloads.size(), 21U);
  for (std::uint8_t k = 0; k <= 20; ++k) {
    EXPECT_EQ(ins_.payloads[k], (std::vector<std::uint8_t>{k, 0xAB}));
  }
  EXPECT_TRUE(others_.payloads.empty()) << "a recorded command reached the bus";
  // 2 s at four times the speed, never earlier. On a busy computer the first one may be late.
  EXPECT_GE(seconds(ins_.last - begin), 0.5);
}

TEST_F(PlayCommand, PlaysAPart) {
  EXPECT_EQ(play({"--from", "0.5", "--duration", "0.3"}), 0) << said_;
  ASSERT_EQ(ins_.payloads.size(), 3U);
  EXPECT_EQ(ins_.payloads[0][0], 5);
  EXPECT_EQ(play({"--from", "1.9", "--to", "2.05"}), 0) << said_;
  EXPECT_EQ(ins_.payloads.size(), 5U);
  EXPECT_EQ(play({"--from", "3"}), 3);
  EXPECT_THAT(said_, HasSubstr("no sensor data"));
}

TEST_F(PlayCommand, RejectsABusThatAlreadyHasTheSensors) {
  EXPECT_EQ(play({}, false, true), 3);
  EXPECT_THAT(said_, HasSubstr("INS already published"));
  EXPECT_TRUE(fixes_.payloads.empty());
}

TEST_F(PlayCommand, StopsOnCtrlC) {
  EXPECT_EQ(play({"--speed", "0.5"}, true), 130) << said_;
  EXPECT_THAT(said_, HasSubstr("stopped after"));
  EXPECT_LT(ins_.payloads.size(), 21U);
}

}  // namespace
}  // namespace rcs::test

// `rcs record` on the command line, on a private bus.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <array>
#include <optional>
#include <set>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tests/support/rcs_command.h"
#include "tools/rcs/vehicle/child_process.h"
#include "tools/recording/log_series.h"

namespace rcs::test {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;

class RecordCommand : public RcsCommand {
 protected:
  RecordCommand() {
    Result<std::unique_ptr<LcmBus>> bus = LcmBus::create("");
    RCS_CHECK(bus.ok());
    bus_ = std::move(bus).value();
    alive_.emplace(bus_.get(), channel::kRecordProcess, 4);
    odometry_.emplace(bus_.get(), channel::kOdometry);
    timeline_.emplace(bus_.get(), &stop_);
  }

  void wait(double s) {
    const Stamp until = timeline_->now() + from_seconds(s);
    while (timeline_->advance(until) == Timeline::Step::kDelivered) {
    }
  }
  /// Starts `rcs record` and waits until it is alive.
  cli::ChildProcess start(const std::vector<std::string>& options = {}) {
    std::vector<std::string> arguments = {"record", recording_, "--reserve-mb", "0"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    Result<cli::ChildProcess> child =
        cli::ChildProcess::start(variable("RCS_BIN_DIR") + "/rcs", arguments);
    RCS_CHECK(child.ok());
    wait_until_alive();
    return std::move(child).value();
  }
  void wait_until_alive() {
    while (!alive_->empty()) alive_->pop();
    for (int k = 0; k < 100 && alive_->empty(); ++k) wait(0.1);
    EXPECT_FALSE(alive_->empty()) << "the recorder does not start";
  }
  /// Odometry at 200 Hz, whose speed is its number.
  void publish(double s) {
    for (const Stamp end = timeline_->now() + from_seconds(s); timeline_->now() < end;) {
      odometry_t m{};
      m.utime = to_utime(timeline_->now());
      m.speed_mps = published_++;
      odometry_->publish(&m);
      wait(0.005);
    }
  }
  cli::Exit end(cli::ChildProcess* child, int signal) {
    child->send_signal(signal);
    for (int k = 0; k < 200; ++k) {
      child->read_output([this](std::string_view line) { said_ += std::string(line) + "\n"; });
      if (const std::optional<cli::Exit> exit = child->collect()) {
        child->read_output([this](std::string_view line) { said_ += std::string(line) + "\n"; });
        return *exit;
      }
      wait(0.05);
    }
    ADD_FAILURE() << "the recorder does not end";
    child->send_signal(SIGKILL);
    return {true, 0};
  }
  /// Numbers of the recorded odometry, and the time of the newest.
  std::vector<int> recorded(Stamp* newest = nullptr) {
    Result<recording::LogSeries> log = recording::LogSeries::open(recording_);
    EXPECT_TRUE(log.ok());
    std::vector<int> numbers;
    LogEvent event;
    odometry_t m{};
    while (log.ok() && log->next(&event)) {
      channels_.insert(event.channel);
      if (event.channel != channel::kOdometry) continue;
      const int size = static_cast<int>(event.data.size());
      EXPECT_EQ(m.decode(event.data.data(), 0, size), size);
      numbers.push_back(static_cast<int>(m.speed_mps));
      if (newest != nullptr) *newest = from_utime(m.utime);
    }
    const LogHealth health = log->health();
    EXPECT_EQ(health.skips, health.truncated ? 1 : 0) << health.summary();
    return numbers;
  }
  [[nodiscard]] std::string audit() const {
    std::string text;
    for (const auto& entry : std::filesystem::directory_iterator(recording_)) {
      if (entry.path().extension() == ".jsonl") text += text_of(entry.path());
    }
    return text;
  }

  StopSignals stop_;
  std::string recording_ = folder_ + "/recording";
  std::unique_ptr<LcmBus> bus_;
  std::optional<Inbox<process_t>> alive_;
  std::optional<Outbox<odometry_t>> odometry_;
  std::optional<LiveTimeline> timeline_;
  std::set<std::string> channels_;
  std::string said_;
  int published_ = 0;
};

std::vector<int> numbers_up_to(int count) {
  std::vector<int> numbers;
  for (int k = 0; k < count; ++k) numbers.push_back(k);
  return numbers;
}

TEST_F(RecordCommand, AKillCostsLessThanASecond) {
  for (const double before : {0.3, 2.1}) {
    std::filesystem::remove_all(recording_);
    published_ = 0;
    cli::ChildProcess recorder = start();
    publish(before);
    const Stamp killed = timeline_->now();
    EXPECT_TRUE(end(&recorder, SIGKILL).by_signal);
    publish(0.2);
    Stamp newest = killed - from_seconds(before);
    const std::vector<int> numbers = recorded(&newest);
    EXPECT_EQ(numbers, numbers_up_to(static_cast<int>(numbers.size())));
    EXPECT_GT(newest, killed - from_seconds(1.0));
    // The next one continues in the same folder and overwrites nothing.
    recorder = start();
    publish(0.2);
    const int published = published_;
    EXPECT_EQ(end(&recorder, SIGINT).code, 0) << said_;
    const std::vector<int> all = recorded();
    EXPECT_EQ(all.back(), published - 1);
    EXPECT_TRUE(std::equal(numbers.begin(), numbers.end(), all.begin()));
  }
}

TEST_F(RecordCommand, CtrlCLosesNothingAndTheAuditLogHasTheCommands) {
  cli::ChildProcess recorder = start();
  Outbox<command_t> commands(bus_.get(), channel::kBgCommand);
  command_t command{};
  command.issuer = "alice";
  command.serial = 4711;
  command.kind = command_t::KIND_EMERGENCY_STOP;
  commands.publish(&command);
  commands.publish(&command);
  publish(0.5);
  const std::string while_it_runs = audit();
  EXPECT_THAT(while_it_runs, HasSubstr("\"issuer\":\"alice\",\"kind\":\"EMERGENCY_STOP\""));
  const int published = published_;
  EXPECT_EQ(end(&recorder, SIGINT).code, 0) << said_;
  EXPECT_EQ(recorded(), numbers_up_to(published));
  EXPECT_THAT(channels_, testing::IsSupersetOf({std::string("ODOMETRY"), std::string("BG_COMMAND"),
                                                std::string("RECORD_PROCESS")}));
  const std::string text = audit();
  EXPECT_EQ(text.find("4711"), text.rfind("4711")) << "a repetition is a line";
  EXPECT_THAT(text, HasSubstr("recorder_started"));
  EXPECT_THAT(text, HasSubstr("recorder_ended"));
  EXPECT_THAT(said_, HasSubstr("0 missing"));
  EXPECT_EQ(rcs("log info " + recording_), 0) << messages();
  EXPECT_THAT(out(), ContainsRegex("ODOMETRY +" + std::to_string(published)));
}

TEST_F(RecordCommand, TheRingKeepsItsSize) {
  cli::ChildProcess recorder = start({"--size-mb", "1", "--segment-mb", "0.1"});
  const std::vector<std::uint8_t> block(20'000, 1);
  for (int k = 0; k < 200; ++k) {
    bus_->publish("CAMERA", block.data(), block.size());
    wait(0.005);
  }
  EXPECT_EQ(end(&recorder, SIGTERM).code, 0) << said_;
  std::uintmax_t bytes = 0;
  std::size_t segments = 0;
  for (const auto& entry : std::filesystem::directory_iterator(recording_)) {
    if (entry.path().extension() != ".log") continue;
    bytes += entry.file_size();
    ++segments;
  }
  EXPECT_LE(bytes, 1'000'000U);
  EXPECT_GE(bytes, 800'000U);
  EXPECT_GE(segments, 8U);
}

TEST_F(RecordCommand, ASecondRecorderInTheFolderIsRejected) {
  cli::ChildProcess recorder = start();
  EXPECT_EQ(rcs("record " + recording_), 3);
  EXPECT_THAT(messages(), HasSubstr("another recorder writes to this folder"));
  EXPECT_EQ(rcs("record /proc/nowhere"), 3);
  EXPECT_THAT(messages(), HasSubstr("/proc/nowhere: cannot record to this folder"));
  EXPECT_EQ(rcs("record"), 2);
  EXPECT_EQ(end(&recorder, SIGTERM).code, 0);
}

/// A terminal that was stopped by Ctrl-S, or a supervisor that hangs: stderr is full.
TEST_F(RecordCommand, ABlockedStderrDoesNotDisturbTheRecording) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe2(ends.data(), O_CLOEXEC), 0);
  ASSERT_EQ(fcntl(ends[1], F_SETFL, O_NONBLOCK), 0);
  const std::string block(4096, 'x');
  while (write(ends[1], block.data(), block.size()) > 0) {
  }
  ASSERT_EQ(fcntl(ends[1], F_SETFL, 0), 0);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDERR_FILENO);
  std::vector<std::string> words = {variable("RCS_BIN_DIR") + "/rcs", "record", recording_,
                                    "--reserve-mb", "1e8"};  // always stopped: it has to report
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  sigset_t none;
  sigemptyset(&none);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK);
  posix_spawnattr_setsigmask(&attributes, &none);
  pid_t pid = 0;
  ASSERT_EQ(posix_spawn(&pid, argv[0], &actions, &attributes, argv.data(), environ), 0);
  wait_until_alive();
  wait(2.5);
  EXPECT_GE(alive_->account().received, 2) << "the recorder hangs";
  EXPECT_THAT(alive_->latest()->note, HasSubstr("recording stopped: disk full"));
  ASSERT_EQ(kill(pid, SIGTERM), 0);
  int status = 0;
  pid_t ended = 0;
  for (int k = 0; k < 100 && ended == 0; ++k) {
    wait(0.05);
    ended = waitpid(pid, &status, WNOHANG);
  }
  EXPECT_EQ(ended, pid) << "the recorder does not end";
  if (ended == 0) (void)kill(pid, SIGKILL);
  EXPECT_TRUE(WIFEXITED(status));
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  (void)close(ends[0]);
  (void)close(ends[1]);
}

/// A BG, and what it publishes.
class RecordedCommands : public RecordCommand {
 protected:
  RecordedCommands() {
    statuses_.emplace(bus_.get(), channel::kBgStatus, 4);
    drives_.emplace(bus_.get(), channel::kBgDrive, 4);
  }
  cli::ChildProcess start_bg() {
    (void)setenv("XDG_STATE_HOME", (folder_ + "/state").c_str(), 1);
    (void)unsetenv("STATE_DIRECTORY");
    Result<cli::ChildProcess> bg = cli::ChildProcess::start(
        variable("RCS_BIN_DIR") + "/bg", {variable("RCS_SOURCE_DIR") + "/config/demo3.toml"});
    RCS_CHECK(bg.ok());
    publisher_ = 0;
    for (int k = 0; k < 100 && publisher_ == 0; ++k) {
      wait(0.1);
      if (const status_t* status = statuses_->latest()) publisher_ = status->publisher_id;
    }
    EXPECT_NE(publisher_, 0);
    return std::move(bg).value();
  }
  /// The newest status of the BG that runs.
  status_t own_status() {
    status_t newest{};
    for (int k = 0; k < 100; ++k) {
      wait(0.05);
      for (; const status_t* status = statuses_->front(); statuses_->pop()) {
        if (status->publisher_id == publisher_) newest = *status;
      }
      if (newest.publisher_id == publisher_) return newest;
    }
    ADD_FAILURE() << "BG is silent";
    return newest;
  }
  void go() {
    Outbox<command_t> commands(bus_.get(), channel::kBgCommand);
    command_t m{};
    m.issuer = "alice";
    m.utime = to_utime(timeline_->now());
    m.serial = m.utime;
    m.boot_id = bus_->publisher().boot_id;
    m.kind = command_t::KIND_GOTO;
    m.frame = command_t::FRAME_LOCAL;
    m.valid_until_utime = m.utime + 500'000;
    m.n = 1;
    m.waypoint.resize(1);
    m.waypoint[0].p_m[0] = 9.0;
    m.waypoint[0].radius_m = 1.0;
    m.waypoint[0].speed_mps = 1.0;
    commands.publish(&m);
    wait(0.3);
  }
  /// Publishes the whole recording, as lcm-logplayer does, but as fast as possible.
  int play_everything() {
    Result<recording::LogSeries> log = recording::LogSeries::open(recording_);
    EXPECT_TRUE(log.ok());
    LogEvent event;
    int commands = 0;
    while (log->next(&event)) {
      bus_->publish(event.channel, event.data.data(), event.data.size());
      commands += event.channel == channel::kBgCommand ? 1 : 0;
      wait(0.001);
    }
    return commands;
  }

  std::optional<Inbox<status_t>> statuses_;
  std::optional<Inbox<drive_t>> drives_;
  std::int64_t publisher_ = 0;
};

TEST_F(RecordedCommands, AreNotActedOnByALiveVehicle) {
  std::int64_t serial = 0;
  {
    cli::ChildProcess recorder = start();
    cli::ChildProcess bg = start_bg();
    go();
    serial = own_status().echo_serial;
    EXPECT_NE(serial, 0) << "BG did not accept the command that is to be recorded";
    // The same BG: the command has expired, and its serial is known.
    EXPECT_EQ(end(&recorder, SIGINT).code, 0);
    wait(0.5);
    EXPECT_EQ(play_everything(), 1);
    EXPECT_EQ(own_status().echo_serial, serial);
    EXPECT_EQ(own_status().new_command, 0);
    end(&bg, SIGTERM);
  }
  // A BG that was started later, with a recorder on the bus.
  std::filesystem::rename(recording_, folder_ + "/first");
  cli::ChildProcess recorder = start();
  cli::ChildProcess bg = start_bg();
  std::filesystem::rename(recording_, folder_ + "/second");
  std::filesystem::rename(folder_ + "/first", recording_);
  EXPECT_EQ(play_everything(), 1);
  EXPECT_EQ(own_status().echo_serial, 0) << "a recorded command was accepted";
  // As documented: `rcs play` publishes sensor channels only.
  EXPECT_EQ(rcs("log cut " + recording_ + " -o " + folder_ + "/all.log"), 0) << messages();
  EXPECT_EQ(rcs("play " + folder_ + "/all.log"), 3);
  EXPECT_THAT(messages(), HasSubstr("no sensor data"));
  EXPECT_EQ(own_status().echo_serial, 0);
  end(&bg, SIGTERM);
  EXPECT_EQ(end(&recorder, SIGTERM).code, 0);
}

}  // namespace
}  // namespace rcs::test

// BG's emergency stop across restarts of its process.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "modules/bg/bg_node.h"
#include "rcs/node/bus/local_bus.h"
#include "tests/support/fresh_folder.h"
#include "tests/support/tap.h"

namespace rcs::bg {
namespace {

namespace fs = std::filesystem;
using test::Tap;

constexpr std::int8_t kStop = command_t::KIND_EMERGENCY_STOP;
constexpr std::int8_t kGoto = command_t::KIND_GOTO;
constexpr std::int8_t kRelease = command_t::KIND_RELEASE;

/// BG's bus; it records at each publication whether the file of the latch exists.
class WatchedBus final : public Bus {
 public:
  explicit WatchedBus(std::string file) : file_(std::move(file)) {}
  void subscribe(std::string_view channel, Receiver* receiver) override {
    bus.subscribe(channel, receiver);
  }
  void publish(std::string_view channel, const std::uint8_t* data, std::size_t size) override {
    if (channel == channel::kBgDrive) file_at_drive = fs::exists(file_);
    if (channel == channel::kBgStatus) file_at_status = fs::exists(file_);
    bus.publish(channel, data, size);
  }

  LocalBus bus;
  bool file_at_drive = false;
  bool file_at_status = false;

 private:
  std::string file_;
};

/// One run of the BG process.
class Life {
 public:
  Life(const std::string& file, StopLatch latch, Stamp* now)
      : now_(now), watched(file), node_(BgConfig(), &watched, std::move(latch)) {}

  void cycle() {
    *now_ += from_milliseconds(50.0);
    if (wm_alive) send_nav();
    deliver();
    StageClock stages;
    stages.start_cycle();
    Cycle c;
    c.wakeup = c.now = *now_;
    c.deadline = *now_ + from_milliseconds(40.0);
    c.stages = &stages;
    drive.reset();
    node_.run(c);
    deliver();
  }
  /// A command that is issued now and arrives in the next cycle.
  void send(std::int8_t kind) {
    *now_ += Duration(1);
    send(kind, to_utime(*now_), to_utime(*now_));
  }
  void send(std::int8_t kind, std::int64_t serial, std::int64_t utime) {
    command_t m{};
    m.issuer = "operator";
    m.kind = kind;
    m.serial = serial;
    m.utime = utime;
    m.valid_until_utime = utime + 2'500'000;
    m.frame = world ? command_t::FRAME_WORLD : command_t::FRAME_LOCAL;
    m.alert_limit_horizontal_m = alert_limit_m;
    m.n = 1;
    m.waypoint.resize(1);
    m.waypoint[0].p_m[0] = 50.0;
    m.waypoint[0].radius_m = 3.0;
    m.waypoint[0].speed_mps = 5.0;
    commands_.publish(&m);
  }

  [[nodiscard]] bool brakes() const {
    return drive && drive->brake == 1 && drive->speed_mps == 0.0;
  }
  [[nodiscard]] bool has_event(const std::string& text) const {
    for (const std::string& e : events) {
      if (e.find(text) != std::string::npos) return true;
    }
    return false;
  }

 private:
  void deliver() {
    while (watched.bus.next_due() != Stamp::max()) watched.bus.deliver_next(*now_);
  }
  void send_nav() {
    nav_state_t m{};
    m.utime = m.publish_utime = to_utime(*now_);
    m.mode = nav_state_t::MODE_GPS_INS_LADAR;
    m.pose_valid = 1;
    m.q_world_vehicle[0] = m.q_local_vehicle[0] = 1.0;
    m.v_world_mps[0] = speed_mps;
    m.world_valid = world ? 1 : 0;
    nav_states_.publish(&m);
    integrity_t integrity{};
    integrity.utime = m.utime;
    integrity.validity = world ? integrity_t::VALID_WORLD : integrity_t::VALID_LOCAL;
    integrity.protection_horizontal_m = integrity.protection_vertical_m = 8.0;
    integrities_.publish(&integrity);
    if (world) send_flat_ground(m.utime);
  }
  void send_flat_ground(std::int64_t utime) {
    constexpr int kSide = 100;
    constexpr std::size_t kCells = std::size_t{kSide} * kSide;
    map_patch_t m{};
    m.utime = utime;
    m.cell_m = 0.4;
    m.first_i = m.first_j = -kSide / 2;
    m.width = m.height = kSide;
    m.n = kCells;
    m.height_cm.assign(kCells, 0);
    m.step_cm.assign(kCells, 0);
    m.slope_deg.assign(kCells, 0);
    m.roughness_cm.assign(kCells, 0);
    m.flags.assign(kCells, 0);
    patches_.publish(&m);
  }

  Stamp* now_;

 public:
  WatchedBus watched;
  double speed_mps = 0.0;
  bool wm_alive = true;
  bool world = false;            // commands and poses in frame world, protection level 8 m
  double alert_limit_m = 0.0;    // of the commands
  std::optional<drive_t> drive;  // of the last cycle
  status_t status{};
  std::vector<std::string> events;

 private:
  Outbox<command_t> commands_{&watched.bus, channel::kBgCommand};
  Outbox<nav_state_t> nav_states_{&watched.bus, channel::kWmNavState};
  Outbox<integrity_t> integrities_{&watched.bus, channel::kWmIntegrity};
  Outbox<map_patch_t> patches_{&watched.bus, channel::kWmMapPatch};
  Tap<drive_t> drives_{&watched.bus, channel::kBgDrive,
                       [this](const drive_t& m, Stamp) { drive = m; }};
  Tap<status_t> statuses_{&watched.bus, channel::kBgStatus,
                          [this](const status_t& m, Stamp) { status = m; }};
  Tap<event_t> events_{&watched.bus, channel::kBgEvent, [this](const event_t& m, Stamp) {
                         events.push_back(m.code + ": " + m.text);
                       }};
  BgNode node_;
};

class BgStop : public testing::Test {
 protected:
  BgStop() : file_((test::fresh_folder() / "state" / "v.stop").string()) { start(); }

  /// Another run: the one before was killed.
  void start() {
    Result<StopLatch> latch = StopLatch::open(file_);
    ASSERT_TRUE(latch.ok());
    life_ = std::make_unique<Life>(file_, std::move(latch).value(), &now_);
  }
  void expect_no_motion_whatever_is_commanded(const std::string& when) {
    for (int k = 0; k < 40; ++k) {
      life_->send(kGoto);
      life_->cycle();
      ASSERT_TRUE(life_->brakes()) << when << ", cycle " << k;
      ASSERT_EQ(life_->status.state, "EMERGENCY_STOP") << when << ", cycle " << k;
    }
    EXPECT_EQ(life_->status.status, +status_t::STATUS_ERROR);
    EXPECT_NE(life_->status.reason.find("emergency stop is latched: release it at rest first"),
              std::string::npos)
        << life_->status.reason;
  }

  Stamp now_{std::chrono::seconds(100)};
  std::string file_;
  std::unique_ptr<Life> life_;
};

TEST_F(BgStop, BrakesInTheCycleOfTheStopThenPersistsThenEchoes) {
  life_->speed_mps = 5.0;
  life_->send(kGoto);
  life_->cycle();
  EXPECT_FALSE(life_->brakes());
  life_->send(kGoto);
  life_->send(kStop, 4242, to_utime(now_));
  for (int k = 0; k < 100; ++k) life_->send(kGoto);
  life_->cycle();
  EXPECT_TRUE(life_->brakes());
  EXPECT_FALSE(life_->watched.file_at_drive) << "braking does not wait for the disk";
  EXPECT_TRUE(life_->watched.file_at_status) << "an echoed stop is a persisted stop";
  EXPECT_EQ(life_->status.emergency_stop, +status_t::STOP_PERSISTED);
  EXPECT_EQ(life_->drive->emergency_stop, 1);
  EXPECT_EQ(life_->status.echo_serial, 4242);
  EXPECT_EQ(life_->status.state, "EMERGENCY_STOP");
  EXPECT_EQ(life_->status.status, +status_t::STATUS_EXEC) << "not at rest yet";
  life_->cycle();
  EXPECT_TRUE(life_->brakes()) << "independently of later commands";
}

TEST_F(BgStop, SurvivesEveryRestartUntilItIsReleasedAtRest) {
  life_->cycle();
  life_->send(kStop);
  life_->cycle();
  for (int k = 0; k < 50; ++k) {
    start();
    expect_no_motion_whatever_is_commanded("life " + std::to_string(k));
    EXPECT_TRUE(life_->has_event("stop.latched")) << "persisted in the file";
    EXPECT_TRUE(life_->has_event(file_));
  }
  life_->speed_mps = 2.0;
  life_->cycle();
  life_->send(kRelease);
  life_->cycle();
  EXPECT_EQ(life_->status.state, "EMERGENCY_STOP") << "not at rest";
  for (int k = 0; k < 60; ++k) life_->cycle();  // and that release has expired
  life_->speed_mps = 0.0;
  life_->cycle();
  EXPECT_EQ(life_->status.state, "EMERGENCY_STOP");
  life_->send(kRelease);
  life_->cycle();
  EXPECT_EQ(life_->status.state, "RELEASED");
  EXPECT_EQ(life_->status.emergency_stop, +status_t::STOP_NONE);
  EXPECT_EQ(life_->status.status, +status_t::STATUS_DONE);
  EXPECT_FALSE(life_->watched.file_at_status) << "an echoed release is a persisted release";
  EXPECT_EQ(life_->drive->emergency_stop, 1)
      << "the drive command precedes the release of the latch";
  life_->cycle();
  EXPECT_EQ(life_->drive->emergency_stop, 0);
  life_->send(kGoto);
  life_->cycle();
  EXPECT_NE(life_->status.state, "EMERGENCY_STOP");
  start();
  life_->send(kGoto);
  life_->cycle();
  EXPECT_NE(life_->status.state, "EMERGENCY_STOP");
}

TEST_F(BgStop, ATaskCanHaveANarrowerAlertLimitThanTheVehicle) {
  life_->world = true;
  life_->cycle();
  const auto state_with_limit = [this](double limit_m) {
    life_->alert_limit_m = limit_m;
    life_->send(kGoto);
    life_->cycle();
    return life_->status.state;
  };
  EXPECT_NE(state_with_limit(0.0), "POSE_UNCERTAIN") << "8 m of 20 m";
  EXPECT_EQ(state_with_limit(5.0), "POSE_UNCERTAIN");
  EXPECT_NE(state_with_limit(9.0), "POSE_UNCERTAIN");
  EXPECT_NE(state_with_limit(std::numeric_limits<double>::quiet_NaN()), "POSE_UNCERTAIN");
}

TEST_F(BgStop, AnOldReleaseOrOneWithoutAKnownSpeedHasNoEffect) {
  life_->cycle();
  life_->send(kStop);
  life_->cycle();
  const std::int64_t before = to_utime(now_);
  start();
  life_->cycle();
  life_->send(kRelease, before, before);  // issued before this run
  life_->cycle();
  EXPECT_EQ(life_->status.state, "EMERGENCY_STOP");
  life_->wm_alive = false;
  for (int k = 0; k < 10; ++k) life_->cycle();
  life_->send(kRelease);
  life_->cycle();
  EXPECT_EQ(life_->status.state, "EMERGENCY_STOP");
  EXPECT_NE(life_->status.reason.find("the world model is silent"), std::string::npos)
      << life_->status.reason;
  EXPECT_TRUE(fs::exists(file_));
}

TEST_F(BgStop, ADamagedFileIsALatchedStopAndCanBeReleased) {
  for (const char* content : {"", "RCS emerg", "\x00\xff garbage"}) {
    std::ofstream(file_) << content;
    start();
    expect_no_motion_whatever_is_commanded(content);
    EXPECT_TRUE(life_->has_event(file_ + " exists, but its content is invalid"));
    life_->send(kRelease);
    life_->cycle();
    EXPECT_EQ(life_->status.state, "RELEASED");
    EXPECT_FALSE(fs::exists(file_));
  }
}

TEST_F(BgStop, AStopThatCannotBePersistedIsInForceAndReported) {
  const fs::path state = fs::path(file_).parent_path();
  fs::remove_all(state);
  std::ofstream(state) << "in the way";
  life_->cycle();
  life_->send(kStop);
  life_->cycle();
  EXPECT_TRUE(life_->brakes());
  EXPECT_EQ(life_->status.status, +status_t::STATUS_ERROR);
  EXPECT_NE(life_->status.reason.find("not persisted: cannot create the folder " + state.string()),
            std::string::npos)
      << life_->status.reason;
  EXPECT_TRUE(life_->has_event("stop.not_persisted"));
  for (int k = 0; k < 100; ++k) life_->cycle();
  EXPECT_TRUE(life_->brakes());
  EXPECT_LE(life_->events.size(), 5U) << "one event per interval, not one per cycle";
  fs::remove(state);
  for (int k = 0; k < 25; ++k) life_->cycle();
  EXPECT_EQ(life_->status.reason, "") << "persisting is retried";
  EXPECT_EQ(life_->status.status, +status_t::STATUS_DONE);
  start();
  expect_no_motion_whatever_is_commanded("after the repair");
}

TEST_F(BgStop, AReleaseThatCannotBePersistedHasNoEffect) {
  life_->cycle();
  life_->send(kStop);
  life_->cycle();
  fs::remove(file_);
  fs::create_directories(fs::path(file_) / "not_empty");
  life_->send(kRelease);
  life_->cycle();
  EXPECT_TRUE(life_->watched.file_at_status);
  EXPECT_EQ(life_->status.status, +status_t::STATUS_ERROR);
  EXPECT_NE(life_->status.reason.find("stays latched: cannot remove " + file_), std::string::npos)
      << life_->status.reason;
  life_->send(kGoto);
  life_->cycle();
  EXPECT_TRUE(life_->brakes());
}

TEST_F(BgStop, AnExtremeSerialDisablesNoStop) {
  life_->cycle();
  for (const std::int8_t kind : {kGoto, kStop}) {
    life_->send(kind, INT64_MAX, 1);  // expired long ago
    life_->cycle();
    life_->send(kRelease);
    life_->cycle();
    ASSERT_EQ(life_->status.state, "RELEASED") << int{kind};
    life_->send(kStop);
    life_->cycle();
    ASSERT_TRUE(life_->brakes()) << int{kind};
    ASSERT_EQ(life_->status.state, "EMERGENCY_STOP") << int{kind};
    life_->send(kRelease);
    life_->cycle();
    ASSERT_EQ(life_->status.state, "RELEASED") << int{kind};
  }
}

TEST(BgStopInReplay, IsLatchedInMemory) {
  Stamp now(std::chrono::seconds(100));
  Life life("", StopLatch(), &now);
  life.cycle();
  life.send(kStop);
  life.cycle();
  life.send(kGoto);
  life.cycle();
  EXPECT_TRUE(life.brakes());
  EXPECT_EQ(life.status.state, "EMERGENCY_STOP");
  life.send(kRelease);
  life.cycle();
  EXPECT_EQ(life.status.state, "RELEASED");
}

}  // namespace
}  // namespace rcs::bg

// BG's emergency stop across restarts of its process.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <string>

#include "tests/bg/bg_life.h"
#include "tests/support/fresh_folder.h"

namespace rcs::bg {
namespace {

namespace fs = std::filesystem;
using test::kGoto;
using test::kRelease;
using test::kStop;
using test::Life;

class BgStop : public testing::Test {
 protected:
  BgStop() : file_((rcs::test::fresh_folder() / "state" / "v.stop").string()) { start(); }

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
    EXPECT_NE(life_->status.reason.find("emergency stop is latched; release it at rest first"),
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

// `rcs go`, a mission or an operator that never noticed the stop.
TEST_F(BgStop, AClientThatGoesOnRenewingItsTaskDoesNotStartTheVehicleAfterTheRelease) {
  life_->sees_ground = true;
  const auto renew = [this](std::int64_t task, const char* issuer) {
    now_ += Duration(1);
    command_t m = life_->command(kGoto, issuer);
    m.task = task;
    life_->send(m);
    life_->cycle();
    return life_->status.state;
  };
  const auto release = [this] {
    life_->send(kRelease);
    life_->cycle();
    ASSERT_EQ(life_->status.state, "RELEASED");
    life_->cycle();
  };
  life_->cycle();
  for (int k = 0; k < 20; ++k) renew(7, "operator");
  life_->send(kStop);
  life_->cycle();
  EXPECT_EQ(renew(3, "mission"), "EMERGENCY_STOP") << "given while the stop is in force";
  release();
  for (int k = 0; k < 50; ++k) {
    ASSERT_EQ(renew(7, "operator"), "REJECTED") << k;
    ASSERT_EQ(renew(3, "mission"), "REJECTED") << k;
  }
  EXPECT_EQ(life_->status.status, +status_t::STATUS_ERROR);
  EXPECT_NE(life_->status.reason.find("give a new command"), std::string::npos);
  EXPECT_NE(renew(8, "operator"), "REJECTED");
  EXPECT_NE(renew(4, "mission"), "REJECTED");

  life_->send(kStop);
  life_->cycle();
  start();
  life_->cycle();
  EXPECT_EQ(renew(8, "operator"), "EMERGENCY_STOP") << "a restarted BG learns of it here";
  release();
  EXPECT_EQ(renew(8, "operator"), "REJECTED");
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

TEST_F(BgStop, TheAlertLimitOfATaskInFrameLocalIsRelativeToTheRollingMap) {
  life_->sees_ground = true;
  life_->cycle();
  const auto state_with = [this](double limit_m, double sigma_m) {
    life_->alert_limit_m = limit_m;
    life_->local_sigma_m = sigma_m;
    life_->send(kGoto);
    life_->cycle();
    return life_->status.state;
  };
  EXPECT_NE(state_with(5.0, 0.02), "POSE_UNCERTAIN") << "the level in frame world is 8 m";
  EXPECT_EQ(state_with(5.0, 1.4), "POSE_UNCERTAIN") << "3.7 standard deviations are 5.2 m";
  EXPECT_NE(state_with(5.0, 1.3), "POSE_UNCERTAIN");
  EXPECT_NE(state_with(0.0, 1.4), "POSE_UNCERTAIN") << "20 m by default";
  EXPECT_EQ(state_with(0.0, std::numeric_limits<double>::quiet_NaN()), "POSE_UNCERTAIN");
  life_->has_rolling_map = false;
  EXPECT_EQ(state_with(0.0, 0.02), "POSE_UNCERTAIN");
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

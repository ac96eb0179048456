// The judges of the drills detect the violations that they are written for.

#include <gtest/gtest.h>

#include "tests/live_faults/count_judge.h"
#include "tests/live_faults/safety_judge.h"

namespace rcs::live_faults {
namespace {

constexpr std::int64_t kTick_us = 10'000;

/// A straight drive with ground truth every 10 ms.
class Driving {
 public:
  explicit Driving(SafetyJudge* judge) : judge_(judge) {}

  void command(double speed_mps, int valid_ms) {
    command_t order{};
    order.kind = command_t::KIND_GOTO;
    order.valid_until_utime = utime_ + 2'500'000;
    judge_->take(order);
    nav_state_t nav{};
    nav.publish_utime = utime_;
    judge_->take(nav);
    drive_t m{};
    m.utime = utime_;
    m.valid_until_utime = utime_ + std::int64_t{1000} * valid_ms;
    m.speed_mps = speed_mps;
    judge_->take(m);
  }
  void go(double seconds, double acceleration_mps2) {
    for (int i = 0; i < static_cast<int>(100.0 * seconds); ++i) {
      utime_ += kTick_us;
      speed_mps_ = std::max(0.0, speed_mps_ + 0.01 * acceleration_mps2);
      truth_.utime = utime_;
      truth_.v_world_mps[0] = speed_mps_;
      truth_.p_world_vehicle_m[0] += 0.01 * speed_mps_;
      judge_->take(truth_, from_utime(utime_));
    }
  }
  truth_t truth_{};
  double speed_mps_ = 3.0;

 private:
  SafetyJudge* judge_;
  std::int64_t utime_ = 1'000'000'000;
};

class SafetyJudgeTest : public testing::Test {
 protected:
  SafetyJudgeTest() { driving_.truth_.clearance_m = 5.0; }

  SafetyJudge judge_{SafetyLimits{}};
  Driving driving_{&judge_};
};

TEST_F(SafetyJudgeTest, AVehicleThatBrakesWhenItsCommandsEndIsSafe) {
  driving_.command(3.0, 250);
  driving_.go(0.3, 0.0);
  driving_.go(2.0, -3.0);
  EXPECT_TRUE(judge_.breaches().empty()) << judge_.breaches().front();
  EXPECT_NEAR(judge_.metrics().deceleration_mps2, 3.0, 0.1);
  EXPECT_NEAR(seconds(judge_.metrics().longest_stand), 1.1, 0.1);
}

TEST_F(SafetyJudgeTest, AVehicleThatRollsOnIsUnsafe) {
  driving_.command(3.0, 250);
  driving_.go(2.0, 0.0);
  ASSERT_EQ(judge_.breaches().size(), 1U);
  EXPECT_EQ(judge_.breaches()[0].rfind("without a command", 0), 0U);
}

TEST_F(SafetyJudgeTest, ACollisionIsCountedOnce) {
  driving_.command(3.0, 10'000);
  for (const double clearance_m : {0.1, -0.1, 0.1}) {
    driving_.truth_.clearance_m = clearance_m;
    driving_.go(0.1, 0.0);
  }
  EXPECT_EQ(judge_.metrics().collisions, 1);
  EXPECT_EQ(judge_.breaches().size(), 1U);
  EXPECT_DOUBLE_EQ(judge_.metrics().clearance_m, -0.1);
}

TEST_F(SafetyJudgeTest, BgDrivesOnNoOutdatedInput) {
  nav_state_t nav{};
  drive_t m{};
  m.speed_mps = 3.0;
  m.utime = 1'000'000;
  judge_.take(nav);
  judge_.take(m);
  ASSERT_EQ(judge_.breaches().size(), 2U);
  EXPECT_EQ(judge_.breaches()[0].rfind("drives blindly", 0), 0U);
  EXPECT_EQ(judge_.breaches()[1].rfind("drives unasked", 0), 0U);
  m.brake = 1;
  m.utime = 9'000'000;
  judge_.take(m);
  EXPECT_EQ(judge_.breaches().size(), 2U) << "braking needs no input";
}

class CountJudgeTest : public testing::Test {
 protected:
  void cycle(std::int64_t seq, std::int64_t received) {
    cycle_t m{};
    m.node = "wm";
    m.seq = seq;
    m.index = seq;
    m.input.resize(1);
    m.input[0].received = received;
    judge_.take(m);
  }
  void process(int pid) {
    process_t m{};
    m.node = "wm";
    m.pid = pid;
    judge_.take(m);
  }

  CountJudge judge_{{{10.0, 0.0}, {50.0, 0.0}, {50.0, 50.0}}, 3.0};
};

TEST_F(CountJudgeTest, CountersRestartWithANewProcessOnly) {
  process(7);
  cycle(1, 5);
  cycle(2, 6);
  process(8);
  cycle(1, 0);
  cycle(2, 1);
  EXPECT_TRUE(judge_.breaches().empty()) << judge_.breaches().front();
  cycle(3, 0);
  EXPECT_EQ(judge_.breaches().size(), 1U) << "within one process";
  cycle(1, 0);
  cycle(2, 0);
  EXPECT_EQ(judge_.breaches().size(), 2U) << "the same process again";
}

TEST_F(CountJudgeTest, AScanIsRegisteredAndFusedOnce) {
  registration_t m{};
  for (m.scan_id = 1; m.scan_id <= 3; ++m.scan_id) judge_.take(m);
  innovation_t i{};
  i.source = innovation_t::SOURCE_ROLLING;
  i.accepted = 1;
  judge_.take(i);
  EXPECT_TRUE(judge_.breaches().empty());
  judge_.take(i);
  EXPECT_EQ(judge_.breaches().size(), 1U);
  m.scan_id = 3;
  judge_.take(m);
  EXPECT_EQ(judge_.breaches().size(), 2U);
}

TEST_F(CountJudgeTest, ACommandIsExecutedOnceAndAWaypointIsDrivenToOnce) {
  status_t m{};
  m.issuer = "operator";
  m.echo_serial = 4;
  m.new_command = 1;
  judge_.take(m);
  truth_t t{};
  for (const double x_m : {0.0, 10.0, 30.0}) {
    t.p_world_vehicle_m[0] = x_m;
    judge_.take(t);
  }
  EXPECT_EQ(judge_.next_waypoint(), 1U);
  EXPECT_TRUE(judge_.breaches().empty());
  t.p_world_vehicle_m[0] = 10.0;  // back to it: no waypoint is skipped
  judge_.take(t);
  EXPECT_EQ(judge_.next_waypoint(), 1U);
  EXPECT_EQ(judge_.returns(), 1);
  EXPECT_TRUE(judge_.breaches().empty());
  judge_.take(m);
  EXPECT_EQ(judge_.breaches().size(), 1U);
  m.new_command = 0;
  command_t asked{};
  asked.issuer = m.issuer;
  asked.task = 9;
  for (const int done : {2, 2, 0}) {
    asked.serial = ++m.echo_serial;
    judge_.take(asked);
    m.waypoints_done = done;
    judge_.take(m);
  }
  EXPECT_EQ(judge_.breaches().size(), 2U);
  t.p_world_vehicle_m[0] = t.p_world_vehicle_m[1] = 50.0;  // one waypoint is skipped
  judge_.take(t);
  EXPECT_EQ(judge_.breaches().size(), 3U);
}

}  // namespace
}  // namespace rcs::live_faults

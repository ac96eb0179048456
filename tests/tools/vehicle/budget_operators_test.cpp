#include "tools/rcs/vehicle/budget_operators.h"

#include <gtest/gtest.h>

#include <optional>

#include "lcmtypes/channels.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/bus/tap.h"

namespace rcs::cli {
namespace {

/// A mission that echoes each command, once a second.
class BudgetMissionTest : public testing::Test {
 protected:
  void run(double seconds, const std::string& state) {
    const Stamp end = now_ + from_seconds(seconds);
    for (int k = 1; now_ < end; ++k) {
      now_ += from_milliseconds(100.0);
      if (k % 10 == 0 && task_) {
        status_t m{};
        m.utime = to_utime(now_);
        m.issuer = task_->issuer;
        m.echo_serial = task_->serial;
        m.status = state == "NO_ROUTE" ? status_t::STATUS_ERROR : status_t::STATUS_EXEC;
        m.state = state;
        statuses_.publish(&m);
      }
      deliver();
      operator_.step(now_);
      deliver();
    }
  }
  void vehicle_at(double x_m) {
    nav_state_t m{};
    m.q_world_vehicle[0] = 1.0;
    m.p_world_vehicle_m[0] = x_m;
    m.world_valid = 1;
    operator_.take(m);
  }
  void deliver() {
    while (bus_.next_due() != Stamp::max()) bus_.deliver_next(now_);
  }

  Stamp now_{from_seconds(100.0)};
  LocalBus bus_;
  Outbox<status_t> statuses_{&bus_, channel::kMissionStatus};
  std::optional<command_t> task_;
  Tap<command_t> tasks_{&bus_, channel::kMissionCommand,
                        [this](const command_t& m, Stamp) { task_ = m; }};
  BudgetMission operator_{&bus_};
};

TEST_F(BudgetMissionTest, GivesAVisitAroundTheVehicleAndRenewsIt) {
  run(3.0, "IDLE");
  EXPECT_FALSE(task_) << "the position in frame world is not known";
  vehicle_at(50.0);
  run(1.0, "PLANNING");
  ASSERT_TRUE(task_);
  EXPECT_EQ(task_->kind, +command_t::KIND_GOTO);
  EXPECT_EQ(task_->frame, +command_t::FRAME_WORLD);
  ASSERT_EQ(task_->waypoint.size(), 4U);
  EXPECT_EQ(task_->waypoint[0].p_m[0], 150.0);
  EXPECT_EQ(task_->waypoint[2].p_m[0], -50.0);
  const command_t first = *task_;
  run(10.0, "DRIVING");
  EXPECT_EQ(task_->task, first.task);
  EXPECT_GT(task_->serial, first.serial);
  run(30.0, "DRIVING");
  EXPECT_NE(task_->task, first.task) << "another search";
}

TEST_F(BudgetMissionTest, WithoutARouteThePlacesAreNearer) {
  vehicle_at(0.0);
  run(1.0, "PLANNING");
  run(4.0, "NO_ROUTE");
  ASSERT_TRUE(task_);
  EXPECT_LE(task_->waypoint[0].p_m[0], 50.0);
  run(60.0, "NO_ROUTE");
  EXPECT_EQ(task_->waypoint[0].p_m[0], 10.0);
}

}  // namespace
}  // namespace rcs::cli

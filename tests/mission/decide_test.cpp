#include "modules/mission/decide.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <string>

namespace rcs::mission {
namespace {

Facts all_is_well() {
  Facts f;
  f.task = TaskKind::kVisit;
  f.operator_received = true;
  f.wm_age = f.bg_age = from_milliseconds(50.0);
  f.pose_valid = true;
  f.world_level = 0.3;
  f.own_map_level = 0.1;
  f.can_return = true;
  f.route = RouteState::kChosen;
  return f;
}

TEST(MissionDecide, DrivesAlongTheChosenRoute) {
  const Decision d = decide(all_is_well(), {});
  EXPECT_EQ(d.action, Action::kDrive);
  EXPECT_EQ(d.state, "DRIVING");
}

TEST(MissionDecide, EveryLossHasARow) {
  const auto state = [](const Facts& f, const DecideParams& p = {}) {
    return std::string(decide(f, p).state);
  };
  Facts f = all_is_well();
  f.bg_age = from_seconds(1.0);
  EXPECT_EQ(state(f), "BG_SILENT");
  f = all_is_well();
  f.wm_age = from_seconds(1.0);
  EXPECT_EQ(state(f), "WM_SILENT");
  f = all_is_well();
  f.gps = false;
  EXPECT_EQ(state(f), "DRIVING_NO_GPS");
  f.world_level = 1.2;
  f.above_limit = from_seconds(1.0);
  EXPECT_EQ(state(f), "ABOVE_ALERT_LIMIT");
  f.above_limit = from_seconds(11.0);
  EXPECT_EQ(state(f), "RETURNING");
  f.can_return = false;
  EXPECT_EQ(state(f), "ABOVE_ALERT_LIMIT");
  f = all_is_well();
  f.gps = false;
  f.route = RouteState::kImpossible;
  EXPECT_EQ(state(f), "RETURNING");
  f.gps = true;
  EXPECT_EQ(state(f), "NO_ROUTE");
}

TEST(MissionDecide, EveryErrorOfBgHasARow) {
  Facts f = all_is_well();
  f.bg_reason = "a reason of BG";
  f.bg_error = BgError::kNoPath;
  EXPECT_EQ(decide(f, {}).action, Action::kReplan);
  f.blocked = 5;
  EXPECT_EQ(decide(f, {}).state, "BLOCKED");

  f.bg_on_task_route = false;
  f.returning = true;
  f.bg_error_for = from_seconds(5.0);
  EXPECT_EQ(decide(f, {}).state, "RETURNING");
  f.bg_error_for = from_seconds(11.0);
  EXPECT_EQ(decide(f, {}).state, "BLOCKED");
  EXPECT_EQ(decide(f, {}).status, Status::kError);
  f.returning = false;
  f.world_known = false;
  EXPECT_EQ(decide(f, {}).state, "BLOCKED") << "while the heading is initialized";

  f = all_is_well();
  f.bg_reason = "a reason of BG";
  f.bg_error = BgError::kRejected;
  EXPECT_EQ(decide(f, {}).action, Action::kRestart);
  f.rejected_for_good = true;
  EXPECT_EQ(decide(f, {}).state, "REFUSED");
  EXPECT_EQ(decide(f, {}).reason, "a reason of BG");

  f.bg_error = BgError::kZone;
  EXPECT_EQ(decide(f, {}).state, "DRIVING");
  f.bg_error_for = from_seconds(11.0);
  EXPECT_EQ(decide(f, {}).state, "ZONE");
  EXPECT_EQ(decide(f, {}).reason, "a reason of BG");
}

TEST(MissionDecide, WhileBgKeepsTheVehicleAtRestItsReasonIsReportedAndTheCommandStays) {
  Facts f = all_is_well();
  f.bg_waits = "waiting because the INS is lost";
  EXPECT_EQ(decide(f, {}).action, Action::kDrive);
  EXPECT_EQ(decide(f, {}).state, "BG_WAITING");
  EXPECT_EQ(decide(f, {}).reason, f.bg_waits);
  f.returning = true;
  EXPECT_EQ(decide(f, {}).action, Action::kReturn);
  EXPECT_EQ(decide(f, {}).state, "BG_WAITING");
  f.world_level = 1.5;
  f.returning = false;
  EXPECT_EQ(decide(f, {}).state, "ABOVE_ALERT_LIMIT")
      << "the mission's own contingencies are first";
}

TEST(MissionDecide, AnEmergencyStopEndsTheTask) {
  Facts f = all_is_well();
  f.emergency_stop = true;
  EXPECT_EQ(decide(f, {}).state, "EMERGENCY_STOP");
  EXPECT_EQ(decide(f, {}).status, Status::kError);
  f.arrived = true;
  f.cannot = "command rejected: a test";
  EXPECT_EQ(decide(f, {}).state, "EMERGENCY_STOP");
}

TEST(MissionDecide, ALostOperatorIsAnsweredAsConfigured) {
  Facts f = all_is_well();
  f.operator_received = false;
  DecideParams p;
  EXPECT_EQ(decide(f, p).action, Action::kDrive);
  p.operator_loss = OperatorLoss::kHold;
  EXPECT_EQ(decide(f, p).state, "OPERATOR_LOST");
  p.operator_loss = OperatorLoss::kReturn;
  EXPECT_EQ(decide(f, p).action, Action::kReturn);
  f.can_return = false;
  EXPECT_EQ(decide(f, p).action, Action::kHalt);
}

TEST(MissionDecide, TheReturnEndsAtTheStart) {
  Facts f = all_is_well();
  f.returning = true;
  f.world_level = 5.0;
  EXPECT_EQ(decide(f, {}).action, Action::kReturn) << "the position on the own map is known";
  f.arrived = true;
  EXPECT_EQ(decide(f, {}).state, "RETURNED");
  f = all_is_well();
  f.task = TaskKind::kReturn;
  EXPECT_EQ(decide(f, {}).action, Action::kReturn);
  f.arrived = true;
  EXPECT_EQ(decide(f, {}).status, Status::kDone);
}

// Invariants over random facts.
TEST(MissionDecide, NothingMovesTheVehicleWithoutWhatItNeeds) {
  std::mt19937 rng(3);
  const auto coin = [&rng] { return rng() % 2 == 0; };
  std::set<int> rows;
  for (int k = 0; k < 1'000'000; ++k) {
    Facts f;
    f.task = static_cast<TaskKind>(rng() % 6);
    f.cannot = rng() % 8 == 0 ? "command rejected: a test" : "";
    f.operator_received = coin();
    f.wm_age = from_seconds(coin() ? 0.1 : 1.0);
    f.bg_age = from_seconds(coin() ? 0.1 : 1.0);
    f.emergency_stop = rng() % 8 == 0;
    f.pose_valid = rng() % 8 != 0;
    f.world_known = rng() % 8 != 0;
    f.world_level = coin() ? 0.5 : 1.5;
    f.own_map_level = coin() ? 0.5 : 1.5;
    f.above_limit = f.world_level > 1.0 ? from_seconds(coin() ? 1.0 : 20.0) : Duration(0);
    f.gps = coin();
    f.can_return = coin();
    f.returning = rng() % 4 == 0;
    f.route = static_cast<RouteState>(rng() % 4);
    f.bg_error = static_cast<BgError>(rng() % 4);
    f.bg_reason = "a reason of BG";
    f.bg_error_for = from_seconds(coin() ? 1.0 : 20.0);
    f.bg_on_task_route = coin();
    f.rejected_for_good = coin();
    f.blocked = static_cast<int>(rng() % 8);
    f.arrived = rng() % 8 == 0;
    DecideParams p;
    p.operator_loss = static_cast<OperatorLoss>(rng() % 3);
    const Decision d = decide(f, p);
    rows.insert(d.line);
    ASSERT_FALSE(d.state.empty());
    ASSERT_EQ(d.status == Status::kError && d.reason.empty(), false) << d.state;
    const bool moves = d.action == Action::kDrive || d.action == Action::kReturn;
    if (!moves) continue;
    ASSERT_TRUE(f.cannot.empty() && f.pose_valid && !f.emergency_stop);
    ASSERT_LT(seconds(f.wm_age), 0.5);
    ASSERT_LT(seconds(f.bg_age), 0.5);
    ASSERT_NE(f.task, TaskKind::kNone);
    ASSERT_NE(f.task, TaskKind::kHold);
    if (d.action == Action::kDrive) {
      ASSERT_TRUE(f.world_known);
      ASSERT_LE(f.world_level, 1.0);
      ASSERT_EQ(f.route, RouteState::kChosen);
      ASSERT_TRUE(f.operator_received || p.operator_loss == OperatorLoss::kContinue);
    } else {
      ASSERT_LE(f.own_map_level, 1.0);
      ASSERT_TRUE(f.can_return);
    }
  }
  EXPECT_EQ(rows.size(), 28U) << "a row that no facts reach";
}

}  // namespace
}  // namespace rcs::mission

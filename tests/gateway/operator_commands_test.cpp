#include "modules/gateway/operator_commands.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/gateway/operator_command_samples.h"

namespace rcs::gateway {
namespace {

using test::go_to;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(OperatorCommands, AValidCommandIsAccepted) {
  EXPECT_EQ(check(go_to("alice", 1), Limits{}), Refusal::kNone);
}

TEST(OperatorCommands, EveryNumberOfAWaypointMustBeFiniteAndInItsRange) {
  const auto refusal = [](auto&& spoil) {
    WaypointCommand order = go_to("alice", 1);
    spoil(&order.waypoints.back());
    return check(order, Limits{});
  };
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    for (int axis = 0; axis < 3; ++axis) {
      EXPECT_EQ(refusal([&](Waypoint* w) { w->p_m[axis] = bad; }), Refusal::kNotFinite);
    }
    EXPECT_EQ(refusal([&](Waypoint* w) { w->radius_m = bad; }), Refusal::kNotFinite);
    EXPECT_EQ(refusal([&](Waypoint* w) { w->speed_mps = bad; }), Refusal::kNotFinite);
  }
  EXPECT_EQ(refusal([](Waypoint* w) { w->p_m.y() = -1e6; }), Refusal::kPosition);
  EXPECT_EQ(refusal([](Waypoint* w) { w->radius_m = 0.0; }), Refusal::kRadius);
  EXPECT_EQ(refusal([](Waypoint* w) { w->radius_m = -1.0; }), Refusal::kRadius);
  EXPECT_EQ(refusal([](Waypoint* w) { w->radius_m = 1e4; }), Refusal::kRadius);
  EXPECT_EQ(refusal([](Waypoint* w) { w->speed_mps = 0.0; }), Refusal::kSpeed);
  EXPECT_EQ(refusal([](Waypoint* w) { w->speed_mps = -3.0; }), Refusal::kSpeed);
  EXPECT_EQ(refusal([](Waypoint* w) { w->speed_mps = 300.0; }), Refusal::kSpeed);
}

TEST(OperatorCommands, CountTimeKindFrameAndIdAreBounded) {
  const auto refusal = [](auto&& spoil) {
    WaypointCommand order = go_to("alice", 1);
    spoil(&order);
    return check(order, Limits{});
  };
  EXPECT_EQ(refusal([](WaypointCommand* o) { o->waypoints.clear(); }), Refusal::kCount);
  EXPECT_EQ(refusal([](WaypointCommand* o) { o->waypoints.resize(65, o->waypoints[0]); }),
            Refusal::kCount);
  EXPECT_EQ(refusal([](WaypointCommand* o) { o->valid_for = -o->valid_for; }), Refusal::kValidFor);
  EXPECT_EQ(refusal([](WaypointCommand* o) { o->valid_for = Duration(0); }), Refusal::kValidFor);
  EXPECT_EQ(refusal([](WaypointCommand* o) { o->valid_for = from_seconds(3600.0); }),
            Refusal::kValidFor);
  EXPECT_EQ(refusal([](WaypointCommand* o) { o->kind = 4; }), Refusal::kKind);
  EXPECT_EQ(refusal([](WaypointCommand* o) { o->kind = -1; }), Refusal::kKind);
  EXPECT_EQ(refusal([](WaypointCommand* o) { o->frame = 2; }), Refusal::kFrame);
  EXPECT_EQ(refusal([](WaypointCommand* o) { o->command_id = 0; }), Refusal::kCommandId);
  EXPECT_EQ(refusal([](WaypointCommand* o) { o->command_id = -1; }), Refusal::kCommandId);
}

TEST(OperatorCommands, TasksNeedAMissionAndAreInFrameWorld) {
  WaypointCommand follow = go_to("alice", 1);
  follow.kind = kKindFollow;
  WaypointCommand back = go_to("alice", 1);
  back.kind = kKindReturn;
  back.waypoints.clear();
  EXPECT_EQ(check(follow, Limits{}), Refusal::kNoMission);
  EXPECT_EQ(check(back, Limits{}), Refusal::kNoMission);
  Limits tasks;
  tasks.tasks = true;
  EXPECT_EQ(check(follow, tasks), Refusal::kNone);
  EXPECT_EQ(check(back, tasks), Refusal::kNone);
  EXPECT_EQ(check(go_to("alice", 1), tasks), Refusal::kNone);
  follow.frame = kFrameLocal;
  EXPECT_EQ(check(follow, tasks), Refusal::kTaskFrame);
  back.waypoints.resize(1);
  EXPECT_EQ(check(back, tasks), Refusal::kCount);
}

TEST(OperatorCommands, AHaltIsRejectedForAnInvalidSenderOnly) {
  WaypointCommand halt = go_to("alice", 1);
  halt.kind = kKindHalt;
  halt.frame = 7;
  halt.valid_for = Duration(-1);
  halt.waypoints.resize(500);
  EXPECT_EQ(check(halt, Limits{}), Refusal::kNone);
  halt.operator_id = "";
  EXPECT_EQ(check(halt, Limits{}), Refusal::kOperator);
}

TEST(OperatorCommands, ANameIsShortAndOfPlainCharacters) {
  EXPECT_TRUE(is_name("Alice_2-b"));
  EXPECT_TRUE(is_name(std::string(32, 'a')));
  for (const std::string bad : {"", "*", "a b", "a.b", "../a", "a\n", "{}", "\xc3\xa4"}) {
    EXPECT_FALSE(is_name(bad)) << bad;
  }
  EXPECT_FALSE(is_name(std::string(33, 'a')));
}

TEST(OperatorCommands, EveryRejectionHasAText) {
  for (std::size_t i = 0; i < kRefusals; ++i) EXPECT_FALSE(text(Refusal(i)).empty());
}

}  // namespace
}  // namespace rcs::gateway

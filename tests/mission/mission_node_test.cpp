// The mission node in lockstep with a simple BG and a simple WM.

#include "modules/mission/mission_node.h"

#include <gtest/gtest.h>

#include "rcs/base/geodesy.h"
#include "tests/mission/mission_life.h"

namespace rcs::mission {
namespace {

using test::Life;

constexpr std::int8_t kVisit = command_t::KIND_GOTO;
constexpr std::int8_t kReturn = command_t::KIND_RETURN;
constexpr std::int8_t kHold = command_t::KIND_HALT;

/// An open a priori map of 800 m a side around the datum of Life.
RouteGround open_ground() {
  return {RouteMap(Area{Vec2(-400.0, -400.0), Vec2(400.0, 400.0)}, RouteMapParams()),
          {radians(40.4), radians(-76.5), {0.0}}};
}

void drive_to(Life* life, double x_m, double y_m) {
  life->x_m = x_m;
  life->y_m = y_m;
  life->cycle();
}

/// Straight along x, 10 m a second, and then back with this lateral offset.
void drive_out(Life* life, double to_m) {
  for (double x = life->x_m; x <= to_m; x += 10.0) drive_to(life, x, 0.0);
}
void drive_back(Life* life, double to_m, double y_m) {
  for (double x = life->x_m; x >= to_m; x -= 10.0) drive_to(life, x, y_m);
}

TEST(MissionNode, VisitsItsPlacesAndReportsThemAsDone) {
  Life life;
  life.give(kVisit, {{100.0, 0.0}, {100.0, 100.0}});
  EXPECT_EQ(life.status.state, "PLANNING");
  ASSERT_TRUE(life.until("DRIVING"));
  EXPECT_EQ(life.bg_last(), Vec2(100.0, 100.0));
  const int places = static_cast<int>(life.bg->waypoint.size());
  life.bg_done = places - 1;
  life.cycles(2);
  EXPECT_EQ(life.status.state, "DRIVING");
  EXPECT_EQ(life.status.waypoints_done, 1);
  life.bg_done = places;
  ASSERT_TRUE(life.until("ARRIVED"));
  EXPECT_EQ(life.status.status, +status_t::STATUS_DONE);
  EXPECT_EQ(life.status.waypoints_done, 2);
}

// BG is sent towards the first place until the heading is known. It may reach it.
TEST(MissionNode, TheFirstPlaceReachedBeforeTheHeadingIsKnownIsNotTheEndOfTheTask) {
  Life life;
  life.world = false;
  life.give(kVisit, {{30.0, 0.0}, {100.0, 100.0}});
  ASSERT_EQ(life.status.state, "INITIALIZING_HEADING");
  ASSERT_EQ(life.bg->waypoint.size(), 1U);
  life.bg_done = 1;
  life.cycles(2);
  EXPECT_EQ(life.status.state, "INITIALIZING_HEADING");
  life.world = true;
  life.cycle();
  EXPECT_EQ(life.status.state, "PLANNING");
  ASSERT_TRUE(life.until("DRIVING"));
  EXPECT_EQ(life.bg_last(), Vec2(100.0, 100.0));
  life.bg_done = static_cast<int>(life.bg->waypoint.size());
  EXPECT_TRUE(life.until("ARRIVED"));
  EXPECT_EQ(life.status.waypoints_done, 2);
}

TEST(MissionNode, AnInterruptedReturnLeadsToTheStartWhenItIsGivenAgain) {
  Life life;
  drive_out(&life, 120.0);
  life.give(kReturn);
  ASSERT_EQ(life.status.state, "RETURNING");
  ASSERT_EQ(life.bg->frame, +command_t::FRAME_ROLLING);
  drive_back(&life, 60.0, 1.2);
  life.give(kHold);
  life.cycles(3);
  life.give(kReturn);
  ASSERT_EQ(life.status.state, "RETURNING");
  for (std::size_t k = 0; k < life.bg->waypoint.size(); ++k) {
    EXPECT_LT(life.bg_place(k).x(), 61.0) << k;
  }
  EXPECT_EQ(life.bg_last(), Vec2(0.0, 0.0));
}

TEST(MissionNode, ABlockedWayBackIsAnErrorAfterAPatience) {
  Life life;
  drive_out(&life, 120.0);
  life.give(kReturn);
  life.bg_error("NO_PATH", "no path to the waypoint was found");
  life.cycles(8);
  EXPECT_EQ(life.status.state, "RETURNING") << "BG goes on searching";
  ASSERT_TRUE(life.until("BLOCKED"));
  EXPECT_EQ(life.status.status, +status_t::STATUS_ERROR);
  EXPECT_FALSE(life.drives());
  life.bg_error("");
  life.cycles(5);
  EXPECT_EQ(life.status.state, "BLOCKED") << "until another task";
  life.give(kReturn);
  EXPECT_EQ(life.status.state, "RETURNING");
}

TEST(MissionNode, AWayBackThatIsBlockedForAShortTimeGoesOn) {
  Life life;
  drive_out(&life, 120.0);
  life.give(kReturn);
  for (int k = 0; k < 4; ++k) {
    life.bg_error("NO_PATH");
    life.cycles(8);
    life.bg_error("");
    life.cycles(2);
    ASSERT_EQ(life.status.state, "RETURNING") << k;
  }
}

TEST(MissionNode, ARejectedRouteBeginsAgainOnceAndIsThenAnError) {
  Life life;
  life.bg_error("REJECTED", "command rejected: waypoint 1 is in keep-out 'pond'");
  life.give(kVisit, {{100.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  const std::int64_t before = life.bg->task;
  ASSERT_TRUE(life.until("PLANNING"));
  ASSERT_TRUE(life.until("DRIVING"));
  EXPECT_NE(life.bg->task, before);
  ASSERT_TRUE(life.until("REFUSED"));
  EXPECT_EQ(life.status.reason, "command rejected: waypoint 1 is in keep-out 'pond'");
  EXPECT_EQ(life.status.status, +status_t::STATUS_ERROR);
  life.cycles(5);
  EXPECT_EQ(life.status.state, "REFUSED");
}

TEST(MissionNode, ARejectedWayBackBeginsAgainOnceAndIsThenAnError) {
  Life life;
  drive_out(&life, 60.0);
  life.bg_error("REJECTED", "command rejected: a test");
  life.give(kReturn);
  const std::int64_t before = life.bg->task;
  ASSERT_TRUE(life.until("PLANNING"));
  ASSERT_TRUE(life.until("RETURNING"));
  EXPECT_NE(life.bg->task, before);
  EXPECT_EQ(life.bg_last(), Vec2(0.0, 0.0));
  ASSERT_TRUE(life.until("REFUSED"));
  EXPECT_EQ(life.status.reason, "command rejected: a test");
}

// BG has ended the task, for an emergency stop that the mission has not received.
TEST(MissionNode, ARouteThatBgHasExecutedDoesNotBeginAgainWhenItIsRejected) {
  Life life;
  life.give(kVisit, {{100.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  life.cycle();
  life.bg_error("REJECTED", "command rejected: an emergency stop has ended its task");
  life.cycle();
  EXPECT_EQ(life.status.state, "REFUSED");
  life.cycles(10);
  EXPECT_EQ(life.status.state, "REFUSED");
  EXPECT_FALSE(life.drives());
}

TEST(MissionNode, AVehicleHeldByAZoneIsAnErrorWithTheReasonOfBg) {
  Life life;
  life.give(kVisit, {{100.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  life.bg_error("ZONE", "the vehicle is near to keep-out 'pond'");
  life.cycles(3);
  EXPECT_EQ(life.status.state, "DRIVING") << "a path that leads out may be found";
  ASSERT_TRUE(life.until("ZONE"));
  EXPECT_EQ(life.status.reason, "the vehicle is near to keep-out 'pond'");
  EXPECT_EQ(life.status.status, +status_t::STATUS_ERROR);
}

TEST(MissionNode, AVehicleThatBgKeepsAtRestIsNoDrivingOne) {
  Life life;
  life.give(kVisit, {{300.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  life.bg_waits("waiting because no LADAR scan was registered recently");
  life.cycles(2);
  EXPECT_EQ(life.status.state, "BG_WAITING");
  EXPECT_EQ(life.status.reason, "waiting because no LADAR scan was registered recently");
  EXPECT_TRUE(life.drives()) << "BG drives on by itself";
  life.bg_waits("");
  life.cycles(2);
  EXPECT_EQ(life.status.state, "DRIVING");
}

// For example because the a priori map was excluded meanwhile.
TEST(MissionNode, ARouteWhoseRestDoesNotKeepTheLimitAnyMoreIsGivenUp) {
  Life life;
  life.alert_limit_m = 5.0;
  life.gps = false;
  drive_out(&life, 60.0);
  life.give(kVisit, {{300.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING_NO_GPS"));
  const std::size_t choices = life.routes.size();
  const int predictions = life.predictions;
  life.cycles(70);
  EXPECT_EQ(life.routes.size(), choices);
  EXPECT_GE(life.predictions - predictions, 3);
  EXPECT_LE(life.predictions - predictions, 4);
  life.predicted_sigma_m = 2.0F;
  ASSERT_TRUE(life.until("RETURNING", 40));
  EXPECT_EQ(life.routes.size(), choices + 1) << "other routes were searched";
}

TEST(MissionNode, WithGpsARouteThatDoesNotKeepTheLimitIsChosenOnce) {
  Life life;
  life.alert_limit_m = 5.0;
  life.predicted_sigma_m = 2.0F;
  life.give(kVisit, {{300.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  life.cycles(70);
  EXPECT_EQ(life.status.state, "DRIVING");
  EXPECT_EQ(life.routes.size(), 1U);
}

TEST(MissionNode, InAnotherFrameWorldTheRouteToTheSamePlaceIsSearchedAgain) {
  Life life;
  life.give(kVisit, {{100.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  const std::size_t choices = life.routes.size();
  const LocalFrame before({radians(40.4), radians(-76.5), {0.0}});
  life.lon_deg = -76.5005;
  const LocalFrame after({radians(40.4), radians(-76.5005), {0.0}});
  const Vec3 wanted = after.from(before) * Vec3(100.0, 0.0, 0.0);
  ASSERT_GT(wanted.x(), 140.0);
  life.cycle();
  EXPECT_EQ(life.status.state, "PLANNING");
  ASSERT_TRUE(life.until("DRIVING"));
  EXPECT_EQ(life.routes.size(), choices + 1);
  EXPECT_LT((life.bg_last() - wanted.head<2>()).norm(), 0.01);
}

TEST(MissionNode, BgKeepsTheAlertLimitOfTheMissionWhereTheTaskStatesNone) {
  MissionConfig config;
  config.limits.alert_limit_m = 7.0;
  Life life(std::nullopt, config);
  life.give(kVisit, {{100.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  EXPECT_EQ(life.bg->alert_limit_horizontal_m, 7.0);
  life.alert_limit_m = 3.0;
  life.give(kVisit, {{100.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  EXPECT_EQ(life.bg->alert_limit_horizontal_m, 3.0);
}

// A search takes some seconds, in which the vehicle drives on.
TEST(MissionNode, ARouteThatIsChosenWhileDrivingBeginsAheadOfTheVehicle) {
  Life life(open_ground());
  life.give(kVisit, {{300.0, 0.0}, {300.0, 300.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  const std::int64_t before = life.bg->task;
  life.gps = false;
  for (int k = 0; k < 20 && life.bg->task == before; ++k) drive_to(&life, life.x_m + 11.0, 1.0);
  ASSERT_NE(life.bg->task, before);
  ASSERT_GT(life.x_m, 50.0);
  EXPECT_GT(life.bg_place(0).x(), life.x_m);
  EXPECT_LT(life.bg_place(0).x(), life.x_m + 41.0);
  EXPECT_EQ(life.bg_last(), Vec2(300.0, 300.0));
  life.bg_done = static_cast<int>(life.bg->waypoint.size());
  EXPECT_TRUE(life.until("ARRIVED"));
  EXPECT_EQ(life.status.waypoints_done, 2);
}

TEST(MissionNode, GroundThatWasBlockedIsFreeForAnotherTask) {
  Life life(open_ground());
  const auto chosen = [&life] { return life.routes.back().route.front(); };
  life.give(kVisit, {{100.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  EXPECT_EQ(chosen().n, 2);
  life.bg_error("NO_PATH");
  ASSERT_TRUE(life.until("PLANNING"));
  life.bg_error("");
  ASSERT_TRUE(life.until("DRIVING"));
  EXPECT_GT(chosen().n, 2) << "around the blocked place";
  life.give(kVisit, {{100.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  EXPECT_EQ(chosen().n, 2);
}

TEST(MissionNode, AfterMaxBlockedRoutesTheTaskHasFailedUntilAnotherTask) {
  MissionConfig config;
  config.decide.max_blocked = 1;
  Life life(open_ground(), config);
  life.give(kVisit, {{100.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  life.bg_error("NO_PATH");
  ASSERT_TRUE(life.until("BLOCKED"));
  life.cycles(5);
  EXPECT_EQ(life.status.state, "BLOCKED");
  EXPECT_FALSE(life.drives());
}

TEST(MissionNode, AnEmergencyStopEndsTheTaskOfAClientThatGoesOnRenewingIt) {
  Life life;
  life.give(kVisit, {{100.0, 0.0}});
  ASSERT_TRUE(life.until("DRIVING"));
  life.stop_latched = true;
  life.renew();
  EXPECT_EQ(life.status.state, "EMERGENCY_STOP");
  life.stop_latched = false;
  for (int k = 0; k < 10; ++k) {
    life.renew();
    ASSERT_EQ(life.status.state, "REFUSED") << k;
    ASSERT_FALSE(life.drives()) << k;
  }
  life.give(kVisit, {{100.0, 0.0}});
  EXPECT_TRUE(life.until("DRIVING"));
}

}  // namespace
}  // namespace rcs::mission

// The whole BG node with zones, in lockstep.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/bg/zone_world.h"

namespace rcs::bg {
namespace {

using zone_world::drive;
using zone_world::Plan;
using zone_world::rectangle;
using zone_world::Result;

Plan straight_on() {
  Plan plan;
  plan.start = {0.0, 0.0, 0.0, 0.0};
  plan.goals = {{50.0, 0.0}};
  return plan;
}

TEST(ZoneDrive, AKeepOutAcrossTheWayIsDrivenAroundWithItsMargin) {
  Plan plan = straight_on();
  plan.zones = {rectangle(ZoneKind::kKeepOut, "pond", 20.0, -8.0, 25.0, 12.0)};
  for (const std::int8_t frame :
       {command_t::FRAME_WORLD, command_t::FRAME_LOCAL, command_t::FRAME_ROLLING}) {
    plan.frame = frame;
    const Result r = drive(plan);
    EXPECT_TRUE(r.done) << r.state << ": " << r.reason;
    EXPECT_GT(r.min_m, 1.0) << "the protection level";
    EXPECT_GT(r.way_m, 50.0);
    EXPECT_EQ(r.states.count("ZONE"), 0U);
  }
}

// A keep-out that is longer than the patch of terrain: its ends come into the patch on the way
// only.
TEST(ZoneDrive, AKeepOutLongerThanThePatchIsDrivenAround) {
  Plan plan = straight_on();
  plan.time_s = 150.0;
  plan.zones = {rectangle(ZoneKind::kKeepOut, "canal", 20.0, -55.0, 25.0, 70.0)};
  const Result r = drive(plan);
  EXPECT_TRUE(r.done) << r.state << ": " << r.reason;
  EXPECT_GT(r.min_m, 1.0);
  EXPECT_LT(r.way_m, 250.0) << "along it once: about 140 m";
}

TEST(ZoneDrive, TheFenceIsKeptThoughTheShortWayLeadsOutOfIt) {
  Plan plan = straight_on();
  plan.goals = {{45.0, 0.0}};
  // An L: from the west end to the south and around the corner.
  Zone fence = rectangle(ZoneKind::kFence, "site", -10.0, -40.0, 60.0, 12.0);
  fence.polygons[0].holes.push_back(
      rectangle(ZoneKind::kFence, "", 15.0, -20.0, 35.0, 11.0).polygons[0].outer);
  plan.zones = {fence};
  const Result r = drive(plan);
  EXPECT_TRUE(r.done) << r.state << ": " << r.reason;
  EXPECT_GT(r.min_m, 1.0);
}

TEST(ZoneDrive, AWaypointInForbiddenGroundIsRejected) {
  Plan plan = straight_on();
  plan.time_s = 5.0;
  plan.goals = {{10.0, 0.0}, {22.0, 0.0}};
  plan.zones = {rectangle(ZoneKind::kKeepOut, "pond", 20.0, -8.0, 25.0, 12.0)};
  for (const std::int8_t frame :
       {command_t::FRAME_WORLD, command_t::FRAME_LOCAL, command_t::FRAME_ROLLING}) {
    plan.frame = frame;
    const Result r = drive(plan);
    EXPECT_EQ(r.state, "REJECTED");
    EXPECT_EQ(r.reason, "command rejected: waypoint 2 is in keep-out 'pond'");
    EXPECT_EQ(r.way_m, 0.0);
  }
  plan.zones = {rectangle(ZoneKind::kFence, "site", -20.0, -20.0, 20.0, 20.0)};
  EXPECT_EQ(drive(plan).reason, "command rejected: waypoint 2 is outside of fence 'site'");
}

TEST(ZoneDrive, AVehicleInForbiddenGroundDrivesOutAndNotFurtherIn) {
  Plan plan = straight_on();
  plan.zones = {rectangle(ZoneKind::kKeepOut, "pond", -6.0, -30.0, 30.0, 5.0)};
  plan.time_s = 90.0;
  // Out to the north; and out, around the zone and to its south: straight on it is 30 m deep.
  for (const Vec2& goal : {Vec2(0.0, 30.0), Vec2(-2.0, -40.0)}) {
    plan.goals = {goal};
    for (const double heading_rad : {0.0, kPi / 2, -kPi / 2, kPi}) {
      plan.start.heading_rad = heading_rad;
      const Result r = drive(plan);
      EXPECT_TRUE(r.done) << heading_rad << ": " << r.state << ": " << r.reason;
      EXPECT_EQ(r.states.count("LEAVING_ZONE"), 1U);
      EXPECT_GT(r.min_m, r.first_m - 0.7) << heading_rad;
    }
  }
}

TEST(ZoneDrive, AVehicleWhoseGoalIsOnTheOtherSideStaysWhereItIs) {
  Plan plan = straight_on();
  // Everything but a hole around the start is forbidden, and the goal is in another hole.
  Zone sea = rectangle(ZoneKind::kKeepOut, "sea", -100.0, -100.0, 100.0, 100.0);
  sea.polygons[0].holes = {
      rectangle(ZoneKind::kKeepOut, "", -5.0, -5.0, 5.0, 5.0).polygons[0].outer,
      rectangle(ZoneKind::kKeepOut, "", 40.0, -10.0, 60.0, 10.0).polygons[0].outer};
  plan.zones = {sea};
  const Result r = drive(plan);
  EXPECT_FALSE(r.done);
  EXPECT_GT(r.min_m, 1.0);
}

TEST(ZoneDrive, WithoutABoundOfThePositionTheVehicleStops) {
  Plan plan = straight_on();
  plan.time_s = 20.0;
  plan.zones = {rectangle(ZoneKind::kKeepOut, "far", 500.0, -8.0, 525.0, 12.0)};
  plan.level_m = [](double t) { return t < 4.0 ? 1.0 : std::numeric_limits<double>::infinity(); };
  for (const std::int8_t frame :
       {command_t::FRAME_WORLD, command_t::FRAME_LOCAL, command_t::FRAME_ROLLING}) {
    plan.frame = frame;
    const Result r = drive(plan);
    EXPECT_FALSE(r.done);
    EXPECT_GT(r.way_m, 3.0);
    EXPECT_LT(r.way_m, 25.0);
  }
  EXPECT_EQ(drive(plan).state, "ZONE_POSE_UNCERTAIN");
  plan.zones.clear();
  EXPECT_TRUE(drive(plan).done) << "a task in frame local, without zones";
}

TEST(ZoneDrive, WithoutAPoseInFrameWorldTheVehicleStands) {
  Plan plan = straight_on();
  plan.frame = command_t::FRAME_LOCAL;
  plan.time_s = 30.0;
  plan.zones = {rectangle(ZoneKind::kFence, "site", -500.0, -500.0, 500.0, 500.0)};
  plan.world_from_s = 1e9;
  Result r = drive(plan);
  EXPECT_EQ(r.state, "ZONE_POSE_UNKNOWN");
  EXPECT_EQ(r.way_m, 0.0);
  plan.world_from_s = 5.0;
  r = drive(plan);
  EXPECT_TRUE(r.done) << r.state;
}

// A task in frame world drives ahead to initialize the heading: with GPS, and far from zones.
TEST(ZoneDrive, TheHeadingIsInitializedFarFromZonesOnly) {
  Plan plan = straight_on();
  plan.time_s = 12.0;
  plan.world_from_s = 1e9;
  plan.zones = {rectangle(ZoneKind::kKeepOut, "pond", 100.0, -50.0, 150.0, 50.0)};
  Result r = drive(plan);
  EXPECT_EQ(r.state, "INITIALIZING_HEADING") << r.reason;
  EXPECT_GT(r.way_m, 5.0);
  plan.gps = false;
  r = drive(plan);
  EXPECT_EQ(r.state, "ZONE_POSE_UNKNOWN");
  EXPECT_EQ(r.way_m, 0.0);
  plan.gps = true;
  plan.zones = {rectangle(ZoneKind::kKeepOut, "pond", 30.0, -50.0, 150.0, 50.0)};
  plan.time_s = 30.0;
  r = drive(plan);
  EXPECT_EQ(r.state, "ZONE_POSE_UNKNOWN");
  EXPECT_NE(r.reason.find("keep-out 'pond' is within 20 m"), std::string::npos) << r.reason;
  EXPECT_GT(r.min_m, 15.0);
}

// A message can have any numbers: the origin of a frame must be a place, and any level is handled.
TEST(ZoneWatch, HandlesAnyDatumAndAnyLevel) {
  GeodeticZones drawn;
  drawn.zones = {rectangle(ZoneKind::kKeepOut, "pond", 50.0, -8.0, 60.0, 8.0),
                 rectangle(ZoneKind::kFence, "site", -90.0, -90.0, 90.0, 90.0)};
  LocalBus bus;
  ZoneWatch zones(drawn, Shape(), &bus);
  vj::Terrain terrain;
  terrain.first = {-50, -50};
  terrain.width = terrain.height = 100;
  terrain.ground.resize(std::size_t{100} * 100);
  Nav nav;
  nav.arrival = zone_world::kStart;
  nav.pose_valid = nav.world_valid = true;
  const auto state = [&](double lat_deg, double level_m) {
    nav.datum = Vec3(lat_deg, -76.57, 150.0);
    zones.update(nav, {nav.arrival, true, level_m, level_m}, false, nav.arrival);
    zones.mark({}, &terrain);
    Facts facts;
    zones.describe({}, 0, &facts);
    return facts.zone;
  };
  constexpr double kNone = std::numeric_limits<double>::infinity();
  EXPECT_EQ(state(40.43, 1.0), ZoneState::kFree);
  for (const double lat_deg : {1e9, -91.0, kNone, std::nan("")}) {
    EXPECT_EQ(state(lat_deg, 1.0), ZoneState::kUnknown) << lat_deg;
  }
  EXPECT_EQ(state(40.43, 1.0), ZoneState::kFree);
  EXPECT_EQ(state(40.43, kNone), ZoneState::kUnbounded);
  EXPECT_EQ(state(40.43, 1e300), ZoneState::kNear);
  EXPECT_EQ(state(-40.43, 1.0), ZoneState::kInside) << "the fence is on the other hemisphere";
}

TEST(ZoneDrive, ZonesFollowAStepOfFrameWorld) {
  Plan plan = straight_on();
  plan.zones = {rectangle(ZoneKind::kKeepOut, "pond", 25.0, -8.0, 30.0, 12.0)};
  plan.level_m = [](double) { return 4.0; };
  // The true position is what WM publishes from 3 s on.
  plan.world_error_m = [](double t) { return t < 3.0 ? Vec2(0.0, -3.0) : Vec2(0.0, 0.0); };
  const Result r = drive(plan);
  EXPECT_TRUE(r.done) << r.state << ": " << r.reason;
  EXPECT_GT(r.min_m, 0.0);
}

// Next to a border the level grows: the vehicle may leave, and no motion leads into the zone.
TEST(ZoneDrive, AGrowingProtectionLevelNextToABorderDoesNotHoldTheVehicleForEver) {
  Plan plan = straight_on();
  plan.zones = {rectangle(ZoneKind::kKeepOut, "wall", -20.0, 3.0, 40.0, 30.0)};
  plan.level_m = [](double t) { return t < 4.0 ? 0.5 : std::min(4.0, 0.5 + 1.0 * (t - 4.0)); };
  const Result r = drive(plan);
  EXPECT_TRUE(r.done) << r.state << ": " << r.reason;
  EXPECT_GT(r.min_m, 0.5);
}

TEST(ZoneDrive, SpeedZonesLimitTheSpeed) {
  Plan plan = straight_on();
  plan.goals = {{80.0, 0.0}};
  plan.time_s = 90.0;
  plan.zones = {rectangle(ZoneKind::kSpeed, "yard", 30.0, -20.0, 50.0, 20.0, 1.5)};
  Result r = drive(plan);
  EXPECT_TRUE(r.done);
  EXPECT_GT(r.fastest_mps, 4.0);
  EXPECT_LT(r.fastest_in_zones_mps, 1.6);
  plan.world_from_s = 1e9;  // it may be in the zone
  plan.frame = command_t::FRAME_LOCAL;
  r = drive(plan);
  EXPECT_TRUE(r.done);
  EXPECT_LT(r.fastest_mps, 1.6);
}

}  // namespace
}  // namespace rcs::bg

#include "modules/gateway/sample_conversion.h"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <string>

#include "tests/gateway/operator_command_samples.h"

namespace rcs::gateway {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

nav_state_t nav_state() {
  nav_state_t m{};
  m.utime = 123;
  m.mode = nav_state_t::MODE_GPS_INS_LADAR;
  m.world_valid = 1;
  m.q_world_vehicle[0] = 1.0;
  m.p_world_vehicle_m[1] = -7.5;
  m.cov_world_pose[2][5] = 0.25;
  m.datum_lat_deg = 39.1;
  m.age_gps_us = -1;
  return m;
}

TEST(GatewayMessages, AVehicleStateCarriesTheNavState) {
  rcs_VehicleState s{};
  ASSERT_TRUE(to_sample(nav_state(), from_seconds(0.02), &s));
  EXPECT_EQ(s.utime, 123);
  EXPECT_EQ(s.age_us, 20'000);
  EXPECT_EQ(s.mode, rcs_NAV_GPS_INS_LADAR);
  EXPECT_TRUE(s.world_valid);
  EXPECT_EQ(s.p_world_vehicle_m[1], -7.5);
  EXPECT_EQ(s.cov_world_pose[6 * 2 + 5], 0.25);
  EXPECT_EQ(s.datum_lat_deg, 39.1);
  EXPECT_EQ(s.age_gps_us, -1);
}

TEST(GatewayMessages, NonFiniteValuesAreNotPublished) {
  rcs_VehicleState s{};
  nav_state_t m = nav_state();
  m.q_world_vehicle[3] = kNan;
  EXPECT_FALSE(to_sample(m, Duration(0), &s));
  m = nav_state();
  m.cov_world_pose[5][5] = kNan;
  EXPECT_FALSE(to_sample(m, Duration(0), &s));
  m = nav_state();
  m.datum_height_m = kNan;
  EXPECT_FALSE(to_sample(m, Duration(0), &s));
  m = nav_state();
  m.mode = 99;
  EXPECT_FALSE(to_sample(m, Duration(0), &s));
}

TEST(GatewayMessages, LongTextsAreShortened) {
  char out[8];
  to_sample(std::string_view("1234567890"), out);
  EXPECT_STREQ(out, "1234567");
  to_sample(std::string_view(), out);
  EXPECT_STREQ(out, "");
}

TEST(GatewayMessages, ACommandIsAttributedToAnOperatorOnlyInThatOperatorsPartition) {
  rcs_WaypointCommand c{};
  std::strcpy(c.operator_id, "alice");
  EXPECT_EQ(from_sample(c, "alice").operator_id, "alice");
  EXPECT_EQ(from_sample(c, "bob").operator_id, "");
  EXPECT_EQ(from_sample(c, "").operator_id, "");
  rcs_EmergencyStop s{};
  std::strcpy(s.operator_id, "alice");
  EXPECT_EQ(from_sample(s, "alice").operator_id, "alice");
  EXPECT_EQ(from_sample(s, "alic").operator_id, "");
}

TEST(GatewayMessages, ACommandIsConvertedWithoutChangeOfItsNumbers) {
  rcs_Waypoint w{{1.0, 2.0, 3.0}, 4.0, 5.0};
  rcs_WaypointCommand c{};
  std::strcpy(c.operator_id, "alice");
  c.command_id = 9;
  c.kind = rcs_COMMAND_GOTO;
  c.frame = rcs_FRAME_LOCAL;
  c.valid_for_ms = -2000;
  c.waypoints = {1, 1, &w, false};
  WaypointCommand order = from_sample(c, "alice");
  EXPECT_EQ(order.valid_for, from_seconds(-2.0)) << "rejected later, not corrected here";

  const Command out = to_command({Action::Kind::kGoto, from_seconds(1.5), &order});
  EXPECT_EQ(out.kind, +command_t::KIND_GOTO);
  EXPECT_EQ(out.frame, +command_t::FRAME_LOCAL);
  EXPECT_EQ(out.task, 9);
  EXPECT_EQ(out.valid_for, from_seconds(1.5));
  ASSERT_EQ(out.waypoints.size(), 1U);
  EXPECT_EQ(out.waypoints[0].p_m[2], 3.0);
  EXPECT_EQ(out.waypoints[0].radius_m, 4.0);
  EXPECT_EQ(out.waypoints[0].speed_mps, 5.0);
  order.kind = kKindFollow;
  EXPECT_EQ(to_command({Action::Kind::kGoto, Duration(1), &order}).kind, +command_t::KIND_FOLLOW);
  order.kind = kKindReturn;
  EXPECT_EQ(to_command({Action::Kind::kGoto, Duration(1), &order}).kind, +command_t::KIND_RETURN);
  EXPECT_EQ(to_command({Action::Kind::kHalt, Duration(1), nullptr}).kind, +command_t::KIND_HALT);
  EXPECT_EQ(to_command({Action::Kind::kEmergencyStop, Duration(1), nullptr}).kind,
            +command_t::KIND_EMERGENCY_STOP);
  EXPECT_EQ(to_command({Action::Kind::kRelease, Duration(1), nullptr}).kind,
            +command_t::KIND_RELEASE);
}

}  // namespace
}  // namespace rcs::gateway

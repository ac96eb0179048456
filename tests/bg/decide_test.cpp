#include "modules/bg/decide.h"

#include <gtest/gtest.h>

#include <random>

namespace rcs::bg {
namespace {

Facts all_is_well() {
  Facts f;
  f.command = CommandKind::kGoto;
  f.command_is_valid = true;
  f.speed_mps = 5.0;
  f.nav_age = from_milliseconds(20.0);
  f.nav_still = from_milliseconds(20.0);
  f.integrity_age = from_milliseconds(100.0);
  f.pose_valid = true;
  f.aligned = true;
  f.ins_age = from_milliseconds(10.0);
  f.ladar_age = from_milliseconds(100.0);
  f.gps_age = from_milliseconds(200.0);
  f.map_age = from_milliseconds(200.0);
  f.speed_share = 1.0;
  f.has_path = true;
  return f;
}

TEST(Decide, DrivesWhenAllInputsAreValid) {
  const Decision d = decide(all_is_well(), false, {});
  EXPECT_EQ(d.action, Action::kDrive);
  EXPECT_EQ(d.status, Status::kExecuting);
  EXPECT_EQ(d.state, "DRIVING");
}

// The contingency table: each loss and the reaction to it.
TEST(Decide, EveryLossHasARowInTheContingencyTable) {
  Facts f = all_is_well();
  f.gps_age = from_seconds(60.0);
  EXPECT_EQ(decide(f, false, {}).action, Action::kDrive);
  f.ladar_age = from_seconds(1.0);
  EXPECT_EQ(decide(f, false, {}).action, Action::kBrake);
  f = all_is_well();
  f.ladar_age = from_seconds(1.0);
  EXPECT_EQ(decide(f, false, {}).action, Action::kStop);
  f = all_is_well();
  f.nav_age = from_seconds(1.0);
  EXPECT_EQ(decide(f, false, {}).action, Action::kBrake);
  f = all_is_well();
  f.nav_still = from_seconds(0.4);
  EXPECT_EQ(decide(f, false, {}).action, Action::kBrake);
  EXPECT_EQ(decide(f, false, {}).state, "POSE_FROZEN");
  f = all_is_well();
  f.integrity_age = from_seconds(1.0);
  EXPECT_EQ(decide(f, false, {}).state, "INTEGRITY_SILENT");
  EXPECT_EQ(decide(f, false, {}).action, Action::kBrake);
  f = all_is_well();
  f.supervisor_silent = true;
  EXPECT_EQ(decide(f, false, {}).state, "SUPERVISOR_SILENT");
  EXPECT_EQ(decide(f, false, {}).action, Action::kBrake);
  f = all_is_well();
  f.second_publisher = true;
  EXPECT_EQ(decide(f, false, {}).state, "SECOND_PUBLISHER");
  EXPECT_EQ(decide(f, false, {}).action, Action::kBrake);
  f = all_is_well();
  f.pose_valid = false;
  EXPECT_EQ(decide(f, false, {}).state, "POSE_INVALID");
  EXPECT_EQ(decide(f, false, {}).action, Action::kBrake);
  f = all_is_well();
  f.ins_age = from_seconds(1.0);
  EXPECT_EQ(decide(f, false, {}).state, "INS_LOST");
  EXPECT_EQ(decide(f, false, {}).action, Action::kStop);
  f = all_is_well();
  f.command_is_valid = false;
  EXPECT_EQ(decide(f, false, {}).action, Action::kStop);
  EXPECT_EQ(decide(f, false, {}).status, Status::kError);
  f = all_is_well();
  f.map_age = from_seconds(10.0);
  EXPECT_EQ(decide(f, false, {}).action, Action::kStop);
  f = all_is_well();
  f.speed_share = 0.0;
  EXPECT_EQ(decide(f, false, {}).action, Action::kStop);
  f = all_is_well();
  f.has_path = false;
  f.without_path = from_seconds(60.0);
  EXPECT_EQ(decide(f, false, {}).status, Status::kError);
}

// Without registrations the vehicle moves only back over the ground that it has just driven over,
// and only with GPS and with scans.
TEST(Decide, BacksOutOfAViewThatDeterminesNoPose) {
  Facts f = all_is_well();
  f.ladar_age = from_seconds(6.0);
  EXPECT_EQ(decide(f, false, {}).state, "LADAR_LOST");
  f.leads_back = true;
  EXPECT_EQ(decide(f, false, {}).state, "BACKING_OUT");
  EXPECT_EQ(decide(f, false, {}).action, Action::kDrive);
  f.map_age = from_seconds(2.0);
  EXPECT_EQ(decide(f, false, {}).state, "LADAR_LOST") << "no scans";
  f = all_is_well();
  f.leads_back = true;
  EXPECT_EQ(decide(f, false, {}).state, "BACKING_OUT") << "out of an obstacle";
  f.speed_share = 0.0;
  EXPECT_EQ(decide(f, false, {}).state, "POSE_UNCERTAIN");
  f = all_is_well();
  f.leads_back = true;
  f.ladar_age = f.gps_age = from_seconds(6.0);
  EXPECT_EQ(decide(f, false, {}).state, "LADAR_AND_GPS_LOST");
}

// In forbidden ground the vehicle moves only along a path that leads out.
TEST(Decide, KeepsToZones) {
  Facts f = all_is_well();
  f.zone_reason = "in keep-out 'pond'";
  f.zone = ZoneState::kUnknown;
  EXPECT_EQ(decide(f, false, {}).state, "ZONE_POSE_UNKNOWN");
  EXPECT_EQ(decide(f, false, {}).action, Action::kStop);
  f.north_known = false;  // it may not drive ahead to initialize its heading either
  EXPECT_EQ(decide(f, false, {}).state, "ZONE_POSE_UNKNOWN");
  f.north_known = true;
  f.zone = ZoneState::kUnbounded;
  EXPECT_EQ(decide(f, false, {}).state, "ZONE_POSE_UNCERTAIN");
  EXPECT_EQ(decide(f, false, {}).action, Action::kStop);
  f.zone = ZoneState::kNear;
  EXPECT_EQ(decide(f, false, {}).state, "ZONE");
  EXPECT_EQ(decide(f, false, {}).action, Action::kStop);
  f.zone = ZoneState::kInside;
  const Decision inside = decide(f, false, {});
  EXPECT_EQ(inside.state, "ZONE");
  EXPECT_EQ(inside.action, Action::kBrake);
  EXPECT_EQ(inside.status, Status::kError);
  EXPECT_EQ(inside.reason, "in keep-out 'pond'");
  for (const ZoneState near : {ZoneState::kNear, ZoneState::kInside}) {
    f.zone = near;
    f.leads_out = true;
    EXPECT_EQ(decide(f, false, {}).state, "LEAVING_ZONE");
    EXPECT_EQ(decide(f, false, {}).action, Action::kDrive);
    EXPECT_EQ(decide(f, false, {}).reason, "in keep-out 'pond'");
    f.has_path = false;
    EXPECT_EQ(decide(f, false, {}).state, "ZONE");
    f.has_path = true;
    f.ladar_age = from_seconds(1.0);  // no other rule is suspended
    EXPECT_EQ(decide(f, false, {}).state, "LADAR_LOST");
    f.ladar_age = from_milliseconds(100.0);
  }
  for (const ZoneState state : {ZoneState::kUnknown, ZoneState::kUnbounded}) {
    f.zone = state;  // leads_out has no meaning there
    EXPECT_EQ(decide(f, false, {}).action, Action::kStop);
    f.ladar_age = from_seconds(6.0);
    f.leads_back = true;
    EXPECT_EQ(decide(f, false, {}).state, "LADAR_LOST") << "no backing out either";
    f.ladar_age = from_milliseconds(100.0);
  }
}

TEST(Decide, AnEmergencyStopHoldsUntilItIsReleasedAtRest) {
  Facts f = all_is_well();
  f.command = CommandKind::kEmergencyStop;
  Decision d = decide(f, false, {});
  EXPECT_EQ(d.action, Action::kBrake);
  EXPECT_TRUE(d.emergency);
  f.command = CommandKind::kGoto;  // from any issuer
  d = decide(f, true, {});
  EXPECT_EQ(d.action, Action::kBrake);
  EXPECT_EQ(d.status, Status::kError);
  EXPECT_FALSE(d.release);
  f.command = CommandKind::kRelease;
  f.command_is_new = true;
  const auto expect_no_release = [&] {
    d = decide(f, true, {});
    EXPECT_TRUE(d.emergency);
    EXPECT_FALSE(d.release);
    EXPECT_EQ(d.action, Action::kBrake);
  };
  f.speed_mps = 3.0;  // not at rest
  expect_no_release();
  f.speed_mps = 0.0;
  f.command_is_valid = false;  // too late
  expect_no_release();
  f.command_is_valid = true;
  f.command_is_new = false;  // it was rejected in the cycle of its arrival
  expect_no_release();
  f.command_is_new = true;
  f.pose_valid = false;
  expect_no_release();
  EXPECT_NE(d.reason.find("no valid pose"), std::string_view::npos);
  f.speed_mps =
      3.0;  // from a pose that is no longer valid: it is not known whether the vehicle is at rest
  expect_no_release();
  EXPECT_NE(d.reason.find("no valid pose"), std::string_view::npos);
  f.speed_mps = 0.0;
  f.pose_valid = true;
  d = decide(f, true, {});
  EXPECT_TRUE(d.release);
  EXPECT_EQ(d.action, Action::kBrake) << "until the latch has been released";
  d = decide(f, false, {});  // it has
  EXPECT_FALSE(d.release);
  EXPECT_FALSE(d.emergency);
  EXPECT_EQ(d.status, Status::kDone);
  f.command = CommandKind::kGoto;
  EXPECT_EQ(decide(f, false, {}).action, Action::kDrive);
}

// For any combination of facts: BG drives only if all preconditions of driving hold.
TEST(Decide, DrivesOnlyWithAllPreconditions) {
  std::mt19937 rng(5);
  const auto chance = [&] { return rng() % 2 == 0; };
  const DecideParams p;
  int driven = 0;
  for (int k = 0; k < 400'000; ++k) {
    Facts f = all_is_well();
    f.command = static_cast<CommandKind>(rng() % 6);
    f.command_is_valid = chance();
    f.cannot = rng() % 8 == 0 ? "cannot" : "";
    f.nav_age = from_milliseconds(static_cast<double>(rng() % 400));
    f.nav_still = from_milliseconds(static_cast<double>(rng() % 600));
    f.integrity_age = from_milliseconds(static_cast<double>(rng() % 800));
    f.pose_valid = rng() % 4 != 0;
    f.ins_age = from_milliseconds(static_cast<double>(rng() % 700));
    f.aligned = chance();
    f.ladar_age = from_milliseconds(static_cast<double>(rng() % 1000));
    f.gps_age = from_milliseconds(static_cast<double>(rng() % 3000));
    f.map_age = from_milliseconds(static_cast<double>(rng() % 3000));
    f.speed_share = chance() ? 1.0 : 0.0;
    f.arrived = chance();
    f.has_path = chance();
    f.leads_back = chance();
    f.zone = static_cast<ZoneState>(rng() % 2 == 0 ? 0 : rng() % 5);
    f.leads_out = chance();
    const bool emergency = rng() % 8 == 0;
    const Decision d = decide(f, emergency, p);
    if (d.action != Action::kDrive) continue;
    ++driven;
    ASSERT_TRUE(f.command == CommandKind::kGoto && f.command_is_valid && f.cannot.empty() &&
                !emergency && f.nav_age <= p.nav_silence && f.nav_still <= p.nav_still &&
                f.integrity_age <= p.integrity_silence && f.pose_valid && f.aligned &&
                f.ins_age <= p.ins_loss && f.map_age <= p.map_loss &&
                (f.ladar_age <= p.ladar_loss || (f.leads_back && f.gps_age <= p.gps_loss)) &&
                f.speed_share > 0.0 && !f.arrived && f.has_path);
    ASSERT_TRUE(f.zone == ZoneState::kFree ||
                (f.leads_out && (f.zone == ZoneState::kNear || f.zone == ZoneState::kInside)));
    ASSERT_EQ(d.status, Status::kExecuting);
  }
  EXPECT_GT(driven, 10);
}

}  // namespace
}  // namespace rcs::bg

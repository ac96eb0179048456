// Closed-loop drives with sensors that fall silent, and what is recorded at alert limits.

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "lcmtypes/channels.h"
#include "rcs/base/protection_quantiles.h"
#include "rcs/node/bus/local_bus.h"
#include "sim/scenario_file.h"
#include "tests/replay/chain.h"
#include "tools/driving/closed_loop.h"

namespace rcs::test {
namespace {

template <class M>
void deliver(LocalBus* bus, std::string_view channel, const M& m) {
  std::vector<std::uint8_t> data(static_cast<std::size_t>(m.getEncodedSize()));
  m.encode(data.data(), 0, static_cast<int>(data.size()));
  bus->deliver(channel, data.data(), data.size(), from_utime(m.utime));
}

/// A vehicle at 2 m/s whose protection level exceeds its limit of 4 m after a second.
/// @param frame  of the task; the level is that of this frame, the other one is 100 m
driving::AlertOutcome outcome(double braking_mps2, std::int8_t frame = command_t::FRAME_WORLD) {
  LocalBus bus;
  vj::SpeedParams limits;
  limits.alert_limit_horizontal_m = 4.0;
  driving::AlertNotes notes(&bus, frame, limits, 2.0, 1.5);
  double speed_mps = 2.0;
  for (int k = 0; k < 500; ++k) {
    const std::int64_t utime = 1'000'000 + 10'000 * k;
    const bool beyond = k >= 100;
    if (k % 10 == 0) {
      integrity_t m{};
      m.utime = utime;
      m.validity = integrity_t::VALID_WORLD;
      const double level_m = beyond ? 4.5 : 1.0;
      const bool world = frame == command_t::FRAME_WORLD;
      m.protection_horizontal_m = world ? level_m : 100.0;
      m.protection_vertical_m = 1.0;
      deliver(&bus, channel::kWmIntegrity, m);
      nav_state_t nav{};
      nav.utime = utime;
      nav.rolling_valid = 1;
      nav.q_world_vehicle[0] = nav.q_local_vehicle[0] = nav.q_rolling_vehicle[0] = 1.0;
      const double sigma_m = (world ? 100.0 : level_m) / kHorizontalQuantile;
      nav.cov_rolling_pose[0][0] = nav.cov_rolling_pose[1][1] = sigma_m * sigma_m;
      deliver(&bus, channel::kWmNavState, nav);
    }
    if (k % 5 == 0) {
      drive_t m{};
      m.utime = utime;
      m.speed_mps = beyond && braking_mps2 > 0.0 ? 0.0 : 2.0;
      deliver(&bus, channel::kBgDrive, m);
    }
    if (beyond) speed_mps = std::max(0.0, speed_mps - 0.01 * braking_mps2);
    truth_t m{};
    m.utime = utime;
    m.v_world_mps[0] = speed_mps;
    deliver(&bus, channel::kSimTruth, m);
  }
  return notes.outcome();
}

TEST(AlertNotes, AVehicleThatStopsIsNotLate) {
  const driving::AlertOutcome o = outcome(1.5);
  EXPECT_EQ(o.crossings, 1);
  EXPECT_EQ(o.late, 0);
  EXPECT_NEAR(o.beyond_m, 2.0 * 2.0 / 3.0, 0.1);
  EXPECT_NEAR(o.beyond_s, 4.0, 0.2);
  EXPECT_EQ(o.too_fast_s, 0.0);
}

TEST(AlertNotes, InFrameLocalTheLevelRelativeToTheMapCounts) {
  const driving::AlertOutcome stops = outcome(1.5, command_t::FRAME_LOCAL);
  EXPECT_EQ(stops.crossings, 1);
  EXPECT_EQ(stops.late, 0);
  EXPECT_NEAR(stops.beyond_s, 4.0, 0.2);
  EXPECT_EQ(outcome(0.0, command_t::FRAME_LOCAL).late, 1);
}

TEST(AlertNotes, AVehicleThatDrivesOnIsLate) {
  const driving::AlertOutcome o = outcome(0.0);
  EXPECT_EQ(o.crossings, 1);
  EXPECT_EQ(o.late, 1);
  EXPECT_NEAR(o.beyond_m, 8.0, 0.2);
  EXPECT_GT(o.too_fast_s, 2.0);
}

TEST(SourceLosses, AreDrawnByTheSeed) {
  for (std::uint64_t seed = 1; seed < 50; ++seed) {
    const std::vector<driving::SourceLoss> losses = driving::draw_losses(seed);
    ASSERT_EQ(losses.size(), 3U);
    for (const driving::SourceLoss& loss : losses) {
      EXPECT_GE(loss.begin_s, 10.0);
      EXPECT_LE(loss.begin_s, 80.0);
      EXPECT_GE(loss.end_s - loss.begin_s, 2.0);
      EXPECT_LE(loss.end_s - loss.begin_s, 60.0);
      EXPECT_FALSE(loss.channels.empty());
    }
    EXPECT_EQ(describe(losses), describe(driving::draw_losses(seed)));
  }
  EXPECT_NE(describe(driving::draw_losses(1)), describe(driving::draw_losses(2)));
}

TEST(AlertDrive, WithoutTheLadarTheVehicleWaits) {
  Result<sim::Scenario> scenario =
      sim::load_scenario(source_path("config/sim/closed_loop.toml"), {});
  ASSERT_TRUE(scenario.ok());
  scenario->course.waypoints_world.resize(2);
  driving::ClosedLoopOptions options;
  options.vehicle_config = source_path("config/demo3.toml");
  options.losses = {{"LADAR", {std::string(channel::kLadarRanges)}, 10.0, 15.0}};
  const driving::ClosedLoopRun run = driving::run_closed_loop(*scenario, options, driving::make_bg);
  std::printf("%s", driving::describe(run).c_str());
  EXPECT_TRUE(run.done) << run.reason;
  EXPECT_EQ(run.alerts.late, 0);
  double lost_s = 0.0;
  for (const auto& [state, time_s] : run.states_s) {
    if (state == "LADAR_LOST") lost_s += time_s;
  }
  EXPECT_GT(lost_s, 3.0);
}

}  // namespace
}  // namespace rcs::test

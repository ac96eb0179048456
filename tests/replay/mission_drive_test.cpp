// The vehicle level drives: a task out, GPS lost, and the way back over the own map.

#include <gtest/gtest.h>

#include "sim/scenario_file.h"
#include "tests/replay/chain.h"
#include "tools/driving/closed_loop.h"

namespace rcs::test {
namespace {

driving::ClosedLoopRun drive(driving::Level level, double gps_lost_after_m, double duration_s) {
  sim::ScenarioOverrides overrides;
  overrides.seed = 3;
  overrides.duration_s = duration_s;
  overrides.gps_lost_after_m = gps_lost_after_m;
  const Result<sim::Scenario> scenario =
      sim::load_scenario(source_path("config/sim/closed_loop.toml"), overrides);
  RCS_CHECK(scenario.ok());
  driving::ClosedLoopOptions options;
  options.vehicle_config = source_path("config/demo3.toml");
  options.alert_limit_m = 20.0;
  options.level = level;
  return driving::run_closed_loop(*scenario, options, driving::make_bg);
}

TEST(MissionDrive, VisitsThePlacesAndReturnsWithoutGps) {
  const driving::ClosedLoopRun run = drive(driving::Level::kVisitReturn, 150.0, 400.0);
  EXPECT_TRUE(run.done) << describe(run);
  EXPECT_EQ(run.reached, 5) << describe(run);
  EXPECT_EQ(run.collisions + run.contacts.total(), 0) << describe(run);
  EXPECT_GT(run.way_back.length_m, 150.0);
  EXPECT_LT(run.way_back.end_m, 3.0) << "the end of the way back is the start";
  EXPECT_GT(run.mission_states_s.at("RETURNING"), 30.0);
}

}  // namespace
}  // namespace rcs::test

// A closed-loop drive with a person who crosses in front of the vehicle.

#include <gtest/gtest.h>

#include <cstdio>

#include "sim/scenario_file.h"
#include "tests/replay/chain.h"
#include "tools/driving/closed_loop.h"

namespace rcs::test {
namespace {

driving::ClosedLoopRun drive(double person_mps) {
  Result<sim::Scenario> scenario = sim::load_scenario(source_path("config/sim/actors.toml"), {});
  RCS_CHECK(scenario.ok());
  scenario->course.waypoints_world.resize(2);
  scenario->actors.clear();
  const Vec2 from = scenario->course.waypoints_world[0];
  const Vec2 ahead = (scenario->course.waypoints_world[1] - from).normalized();
  const Vec2 left(-ahead.y(), ahead.x());
  sim::ActorScript person;
  person.waypoints_world = {from + 30.0 * ahead - 6.0 * left, from + 30.0 * ahead + 15.0 * left};
  person.speed_mps = person_mps;
  person.within_m = 20.0;
  scenario->actors = {person};
  driving::ClosedLoopOptions options;
  options.vehicle_config = source_path("config/demo3.toml");
  return driving::run_closed_loop(*scenario, options, driving::make_bg);
}

TEST(ActorDrive, APersonCrossesWithoutContact) {
  const driving::ClosedLoopRun run = drive(1.2);
  std::printf("%s", driving::describe(run).c_str());
  EXPECT_TRUE(run.done) << run.reason;
  EXPECT_EQ(run.actors.met(), 1);
  EXPECT_TRUE(run.actors.contacts.empty());
  ASSERT_EQ(run.actors.actors.size(), 1U);
  const driving::ActorRecord& person = run.actors.actors[0];
  std::printf("nearest %.1f m; %zu cells, free after %.1f s at most\n", person.nearest_m,
              run.actors.ground.free_after_s.size(), run.actors.ground.worst_s());
  EXPECT_GT(person.nearest_m, 0.3);
  EXPECT_LT(person.nearest_m, 15.0);
  EXPECT_GT(person.path_world.size(), 50U);
  EXPECT_EQ(run.actors.ground.late(), 0);
  // The same again.
  const driving::ClosedLoopRun again = drive(1.2);
  EXPECT_EQ(again.distance_m, run.distance_m);
  EXPECT_EQ(again.actors.actors[0].nearest_m, person.nearest_m);
}

// The person who stands on the path is an obstacle like any other.
TEST(ActorDrive, APersonWhoStandsIsDrivenAround) {
  const driving::ClosedLoopRun run = drive(0.0);
  EXPECT_TRUE(run.done) << run.reason;
  EXPECT_TRUE(run.actors.contacts.empty());
}

}  // namespace
}  // namespace rcs::test

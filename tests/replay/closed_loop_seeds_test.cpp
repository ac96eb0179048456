// Twenty drives over rugged, wooded ground, with GPS and without: `ctest -L slow -R Drive -V`
// prints the table. Nothing was tuned on these seeds (1 to 5 and 301 to 340 were used), nor were
// their drives examined. RCS_FIRST_SEED: other seeds (201: its failures were analysed). RCS_DRIVES:
// fewer than twenty.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "sim/scenario_file.h"
#include "tests/replay/chain.h"
#include "tools/driving/closed_loop.h"

namespace rcs::test {
namespace {

driving::ClosedLoopRun drive(const sim::ScenarioOverrides& overrides) {
  const Result<sim::Scenario> scenario =
      sim::load_scenario(source_path("config/sim/closed_loop.toml"), overrides);
  RCS_CHECK(scenario.ok());
  driving::ClosedLoopOptions options;
  options.vehicle_config = source_path("config/demo3.toml");
  return driving::run_closed_loop(*scenario, options, driving::make_bg);
}

int number_from(const char* variable, int otherwise) {
  const char* const text = std::getenv(variable);
  return text == nullptr ? otherwise : std::atoi(text);
}

struct Tally {
  int done = 0;
  int waypoints = 0;
  int reached = 0;
  int collisions = 0;
  double min_clearance_m = 1e3;
};

Tally drive_seeds(double gps_lost_after_m) {
  const int drives = number_from("RCS_DRIVES", 20);
  const int first_seed = number_from("RCS_FIRST_SEED", 401);
  Tally tally;
  std::printf(
      "seed  done  waypoints  collisions  clearance [m]  foliage  time [s]  way [m]  error [m]\n");
  for (int seed = first_seed; seed < first_seed + drives; ++seed) {
    sim::ScenarioOverrides overrides;
    overrides.seed = seed;
    if (gps_lost_after_m > 0.0) overrides.gps_lost_after_m = gps_lost_after_m;
    const driving::ClosedLoopRun run = drive(overrides);
    const int waypoints = static_cast<int>(run.waypoints_world.size());
    std::printf("%4d  %4s  %5d / %d  %10d  %13.2f  %7d  %8.1f  %7.0f  %9.2f  %s\n", seed,
                run.done ? "yes" : "no", run.reached, waypoints, run.collisions,
                run.min_clearance_m, run.foliage_contacts, run.time_s, run.distance_m,
                run.worst_error_m, run.state.c_str());
    tally.done += run.done ? 1 : 0;
    tally.waypoints += waypoints;
    tally.reached += run.reached;
    tally.collisions += run.collisions;
    tally.min_clearance_m = std::min(tally.min_clearance_m, run.min_clearance_m);
  }
  std::printf("done %d of %d, waypoints %d of %d, collisions %d, smallest clearance %.2f m\n",
              tally.done, drives, tally.reached, tally.waypoints, tally.collisions,
              tally.min_clearance_m);
  return tally;
}

TEST(DriveSeeds, WithGps) {
  const Tally tally = drive_seeds(0.0);
  EXPECT_LE(tally.collisions, 1);
  EXPECT_GE(tally.reached, tally.waypoints * 9 / 10);
}

TEST(DriveSeeds, WithGpsLostAfter100m) {
  const Tally tally = drive_seeds(100.0);
  EXPECT_LE(tally.collisions, 2);
  EXPECT_GE(tally.reached, tally.waypoints * 9 / 10);
}

// LADAR gone for 10 s in a turn: the vehicle stops within the observed terrain, waits, and
// continues.
TEST(Drive, LadarLostInATurnIsAControlledStop) {
  sim::ScenarioOverrides overrides;
  overrides.seed = 1;
  overrides.ladar_outage = sim::Outage{25.0, 10.0};
  const driving::ClosedLoopRun run = drive(overrides);
  std::printf("%s", describe(run).c_str());
  EXPECT_TRUE(run.done) << run.reason;
  EXPECT_EQ(run.collisions, 0);
  double before_mps = 0.0;
  double turn_radps = 0.0;
  double hardest_mps2 = 0.0;
  for (std::size_t k = 1; k < run.trace.size(); ++k) {
    const driving::ClosedLoopSample& s = run.trace[k];
    const double t = seconds(s.stamp - sim::Simulator::kStart);
    if (t > 24.0 && t < 25.0) before_mps = std::max(before_mps, s.speed_mps);
    if (t > 24.0 && t < 27.0) {
      const Quat turn = run.trace[k - 1].T_world_vehicle.q.conjugate() * s.T_world_vehicle.q;
      turn_radps = std::max(turn_radps, std::abs(log_so3(turn).z()) / 0.1);
    }
    if (t > 25.0 && t < 35.0) {
      hardest_mps2 = std::max(hardest_mps2, (run.trace[k - 1].speed_mps - s.speed_mps) / 0.1);
    }
    if (t > 30.0 && t < 35.0) {
      EXPECT_LT(s.speed_mps, 0.2) << "at " << t << " s";
    }
  }
  std::printf("before %.1f m/s, turning %.2f rad/s, braking at most %.1f m/s2\n", before_mps,
              turn_radps, hardest_mps2);
  EXPECT_GT(before_mps, 1.0);
  EXPECT_LT(hardest_mps2, 3.5);
}

}  // namespace
}  // namespace rcs::test

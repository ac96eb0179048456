// Twenty drives over rugged, wooded ground, with GPS and without: `ctest -L slow -R Drive -V`
// prints the table. Nothing was tuned on these seeds (1 to 5 and 301 to 340 were used), nor were
// their drives examined. RCS_FIRST_SEED: other seeds (201: its failures were analysed). RCS_DRIVES:
// fewer than twenty.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <optional>

#include "sim/scenario_file.h"
#include "tests/replay/drive_series.h"

namespace rcs::test {
namespace {

struct Tally {
  int waypoints = 0;
  int reached = 0;
  int contacts = 0;
};

Tally drive_seeds(std::optional<double> gps_lost_after_m) {
  driving::DriveCampaign campaign;
  campaign.scenario = source_path("config/sim/closed_loop.toml");
  campaign.gps_lost_after_m = gps_lost_after_m;
  Tally tally;
  const int first_seed = number_from("RCS_FIRST_SEED", 401);
  for (const auto& [seed, run] :
       drive_series(campaign, first_seed, number_from("RCS_DRIVES", 20))) {
    tally.waypoints += static_cast<int>(run.waypoints_world.size());
    tally.reached += run.reached;
    tally.contacts += driving::contacts(run);
  }
  return tally;
}

TEST(DriveSeeds, WithGps) {
  const Tally tally = drive_seeds({});
  EXPECT_EQ(tally.contacts, 0);
  EXPECT_GE(tally.reached, tally.waypoints * 9 / 10);
}

TEST(DriveSeeds, WithGpsLostAfter100m) {
  const Tally tally = drive_seeds(100.0);
  EXPECT_EQ(tally.contacts, 0);
  EXPECT_GE(tally.reached, tally.waypoints * 9 / 10);
}

// LADAR gone for 10 s in a turn: the vehicle stops within the observed terrain, waits, and
// continues.
TEST(Drive, LadarLostInATurnIsAControlledStop) {
  sim::ScenarioOverrides overrides;
  overrides.seed = 1;
  overrides.ladar_outage = sim::Outage{25.0, 10.0};
  const Result<sim::Scenario> scenario =
      sim::load_scenario(source_path("config/sim/closed_loop.toml"), overrides);
  RCS_CHECK(scenario.ok());
  driving::ClosedLoopOptions options;
  options.vehicle_config = source_path("config/demo3.toml");
  const driving::ClosedLoopRun run = driving::run_closed_loop(*scenario, options, driving::make_bg);
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

// Drives with a hazard across each leg of the course (config/sim/hazards.toml): `ctest -L slow -R
// HazardDrives -V` prints the table. RCS_FIRST_SEED, RCS_DRIVES: other seeds, and their number for
// each kind of hazard. RCS_MORE_CONFIG: TOML text behind the vehicle's configuration.

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "sim/scenario_file.h"
#include "tests/replay/chain.h"
#include "tests/support/fresh_folder.h"
#include "tools/driving/closed_loop.h"

namespace rcs::test {
namespace {

int number_from(const char* variable, int otherwise) {
  const char* const text = std::getenv(variable);        // NOLINT(concurrency-mt-unsafe)
  return text == nullptr ? otherwise : std::atoi(text);  // NOLINT(cert-err34-c)
}

driving::ClosedLoopRun drive(const std::string& kind, int seed) {
  const std::string path = (fresh_folder() / "scenario.toml").string();
  std::ofstream(path) << "based_on = \"" << source_path("config/sim/hazards.toml")
                      << "\"\n[hazards]\nkinds = [\"" << kind << "\"]\n";
  sim::ScenarioOverrides overrides;
  overrides.seed = seed;
  const Result<sim::Scenario> scenario = sim::load_scenario(path, overrides);
  RCS_CHECK(scenario.ok());
  driving::ClosedLoopOptions options;
  options.vehicle_config = source_path("config/demo3.toml");
  const char* const more = std::getenv("RCS_MORE_CONFIG");  // NOLINT(concurrency-mt-unsafe)
  if (more != nullptr) options.more_config = more;
  return driving::run_closed_loop(*scenario, options, driving::make_bg);
}

constexpr const char* kHazards[] = {"drop", "ledge", "ditch", "wall", "bank"};

TEST(HazardDrives, NoContact) {
  const int drives = number_from("RCS_DRIVES", 4);
  const int first_seed = number_from("RCS_FIRST_SEED", 501);
  int all = 0;
  int arrived = 0;
  int contacts = 0;
  std::printf(
      "hazard  seed  done  waypoints  edge  body  tipped  collisions  time [s]  mean [m/s]  "
      "state\n");
  for (const char* const kind : kHazards) {
    for (int seed = first_seed; seed < first_seed + drives; ++seed) {
      const driving::ClosedLoopRun run = drive(kind, seed);
      std::printf("%-6s  %4d  %4s  %5d / %zu  %4d  %4d  %6d  %10d  %8.1f  %10.2f  %s\n", kind, seed,
                  run.done ? "yes" : "no", run.reached, run.waypoints_world.size(),
                  run.contacts.edge, run.contacts.body, run.contacts.tipped, run.collisions,
                  run.time_s, run.mean_mps, run.state.c_str());
      std::fflush(stdout);
      ++all;
      arrived += run.done ? 1 : 0;
      const int touched = run.contacts.total() + run.collisions;
      contacts += touched;
      EXPECT_EQ(touched, 0) << kind << ", seed " << seed;
      EXPECT_TRUE(run.done) << kind << ", seed " << seed;
    }
  }
  std::printf("arrived %d of %d, contacts %d\n", arrived, all, contacts);
}

}  // namespace
}  // namespace rcs::test

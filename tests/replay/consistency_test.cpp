// Does the truth lie within what WM claims? The whole chain on seeds of the reference simulation,
// with GPS and 60 s without it. RCS_SEEDS sets how many seeds (default 20), RCS_FIRST_SEED the
// first.

#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "sim/scenario_file.h"
#include "tests/replay/chain.h"

namespace rcs::test {
namespace {

int from_environment(const char* name, int otherwise) {
  const char* value = std::getenv(name);
  return value == nullptr ? otherwise : std::atoi(value);
}

sim::Scenario scenario_of(int seed, double outage_begin_s, double outage_length_s) {
  sim::ScenarioOverrides overrides;
  overrides.seed = seed;
  overrides.ins_grade = "tactical";
  overrides.duration_s = 100.0;
  if (outage_length_s > 0.0) overrides.gps_outage = {outage_begin_s, outage_length_s};
  Result<sim::Scenario> scenario =
      load_scenario(source_path("config/sim/reference.toml"), overrides);
  RCS_CHECK(scenario.ok());
  return std::move(scenario).value();
}

struct Sum {
  Nees nees;
  int n = 0;
  double square_m2 = 0.0;

  void add(const ChainRun& run, double at_s) {
    BeliefSample belief;
    TruthSample truth;
    const Stamp begin = run.truth.front().stamp;
    if (!run.at(begin + from_seconds(at_s), &belief, &truth) || !belief.world_valid) {
      ADD_FAILURE() << "no valid world pose at " << at_s << " s";
      return;
    }
    const Nees one = test::nees(belief, truth);
    nees.position += one.position;
    nees.attitude += one.attitude;
    nees.velocity += one.velocity;
    nees.pose += one.pose;
    square_m2 += (belief.T_world_vehicle.p - truth.T_world_vehicle.p).squaredNorm();
    ++n;
  }
  void print(const char* what) const {
    std::printf(
        "%-34s NEES per dof: position %5.2f attitude %5.2f velocity %5.2f pose %5.2f"
        "   rms error %.3f m  (n = %d)\n",
        what, nees.position / n, nees.attitude / n, nees.velocity / n, nees.pose / n,
        std::sqrt(square_m2 / n), n);
    std::fflush(stdout);
  }
  void expect_honest(const char* what) const {
    EXPECT_GT(nees.pose / n, 0.3) << what;
    EXPECT_LT(nees.pose / n, 2.0) << what;
    EXPECT_LT(nees.velocity / n, 2.0) << what;
  }
};

TEST(Consistency, TruthLiesWithinWhatWmClaims) {
  const int seeds = from_environment("RCS_SEEDS", 20);
  const int first = from_environment("RCS_FIRST_SEED", 101);
  const std::string vehicle = source_path("config/demo3.toml");
  const std::vector<double> with_gps_s = {20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0};
  const std::vector<double> without_s = {40.0, 50.0, 60.0, 70.0, 80.0, 89.0};
  Sum gps;
  Sum denied;
  Sum denied_end;
  Sum prior_end;
  Sum inertial_end;
  for (int seed = first; seed < first + seeds; ++seed) {
    const ChainRun with = run_chain(scenario_of(seed, 0, 0), vehicle, {true, true, false, {}});
    for (const double t : with_gps_s) gps.add(with, t);
    const ChainRun without = run_chain(scenario_of(seed, 30, 60), vehicle, {true, true, false, {}});
    for (const double t : without_s) denied.add(without, t);
    denied_end.add(without, 89.5);
    prior_end.add(run_chain(scenario_of(seed, 30, 60), vehicle, {true, true, true, {}}), 89.5);
    inertial_end.add(run_chain(scenario_of(seed, 30, 60), vehicle, {false, false, false, {}}),
                     89.5);
    std::printf("seed %d done\n", seed);
    std::fflush(stdout);
  }
  gps.print("with GPS");
  denied.print("without GPS for 10-59 s");
  denied_end.print("  at the end of 60 s");
  prior_end.print("  the same with an a priori map");
  inertial_end.print("  inertial navigation alone");
  gps.expect_honest("with GPS");
  denied.expect_honest("without GPS");
  prior_end.expect_honest("with an a priori map");
  EXPECT_LT(denied_end.square_m2, inertial_end.square_m2);
}

}  // namespace
}  // namespace rcs::test

// The drawing of faults and the metrics of a run of `rcs faults`.
#include "tools/drills/random_faults.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "tools/drills/fault_metrics.h"

namespace rcs::drills {
namespace {

RandomFaultPlan plan_of(int faults) {
  RandomFaultPlan plan;
  plan.scenarios = {"a.toml", "b.toml", "c.toml"};
  plan.first_seed = 77;
  plan.faults = faults;
  return plan;
}

bool equal(const RandomFault& a, const RandomFault& b) {
  return a.classes == b.classes && a.gps_lost == b.gps_lost && a.seed == b.seed &&
         a.drill.name == b.drill.name && a.drill.begin_s() == b.drill.begin_s();
}

TEST(RandomFaults, EveryClassIsDrawnEquallyOftenOnEveryTerrain) {
  const std::size_t classes = fault_classes().size();
  std::map<std::size_t, int> count;
  std::map<std::size_t, std::set<std::string>> terrains;
  const int runs = static_cast<int>(classes) * 30;
  for (int k = 0; k < runs; ++k) {
    const RandomFault f = random_fault(plan_of(1), k);
    ASSERT_EQ(f.classes.size(), 1U);
    ++count[f.classes[0]];
    terrains[f.classes[0]].insert(f.drill.run.scenario);
  }
  for (std::size_t c = 0; c < classes; ++c) {
    EXPECT_EQ(count[c], 30) << fault_classes()[c].name;
    EXPECT_EQ(terrains[c].size(), 3U) << fault_classes()[c].name;
  }
}

TEST(RandomFaults, ARunIsAFunctionOfSeedAndIndex) {
  int lost = 0;
  for (int k = 0; k < 100; ++k) {
    const RandomFault f = random_fault(plan_of(2), k);
    EXPECT_TRUE(equal(f, random_fault(plan_of(2), k)));
    EXPECT_FALSE(equal(f, random_fault(plan_of(2), k + 1)));
    lost += f.gps_lost ? 1 : 0;
    const auto source = [&](std::size_t i) { return fault_classes()[f.classes[i]].source; };
    EXPECT_NE(source(0), source(1));
    // GPS that is faulty is not lost at the same time.
    const bool of_gps = source(0) == DrillSource::kGps || source(1) == DrillSource::kGps;
    EXPECT_FALSE(of_gps && f.gps_lost);
  }
  EXPECT_GT(lost, 20);
  EXPECT_LT(lost, 60);
}

TEST(RandomFaults, GpsIsLostFromBeforeTheFaultUntilAfterIt) {
  for (int k = 0; k < 100; ++k) {
    const RandomFault f = random_fault(plan_of(1), k);
    if (!f.gps_lost) continue;
    ASSERT_EQ(f.drill.stimuli.size(), 2U);
    EXPECT_DOUBLE_EQ(f.drill.stimuli[1].begin_s, f.drill.stimuli[0].begin_s - 5.0);
    EXPECT_NEAR(f.drill.stimuli[1].end_s(), f.drill.stimuli[0].end_s() + 5.0, 1e-9);
  }
}

/// A drive along x at 10 m/s whose belief is off by `error_m`, with a protection level of 3 m.
DrillRecord record_of(double error_m) {
  DrillRecord r;
  r.begin = Stamp();
  for (int k = 0; k <= 1000; ++k) {
    const Stamp t = Stamp() + from_seconds(0.1 * k);
    Pose truth;
    truth.p.x() = k;
    r.truth.push_back({t, truth});
    DrillBelief b;
    b.stamp = t;
    b.T_world_vehicle = truth;
    if (k > 500) b.T_world_vehicle.p.y() = error_m;
    b.T_local_vehicle = truth;
    b.v_local = {10.0, 0.0, 0.0};
    b.cov_world_pose.setIdentity();
    r.beliefs.push_back(b);
    r.integrity.push_back({t, 3.0, 3.0, 20.0, 20.0, 0, 1, 1});
    r.end = t;
  }
  return r;
}

int index_of(std::string_view name) {
  const auto& all = fault_classes();
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (all[k].name == name) return static_cast<int>(k);
  }
  return -1;
}

TEST(FaultMetrics, ErrorsBeyondTheLevelAndWrongExclusionsAreCounted) {
  const int index = index_of("gyro bias");
  const RandomFault f = random_fault(plan_of(1), index);
  const double begin_s = f.drill.stimuli[0].begin_s;
  DrillRecord record = record_of(5.0);
  const Stamp found = Stamp() + from_seconds(begin_s + 4.0);
  record.events = {
      {found, "wm", 1, "fde", "INS excluded: it contradicts"},
      {found, "wm", 1, "fde", "GPS excluded: it contradicts"},
      {Stamp() + from_seconds(99.0), "wm", 1, "fde", "INS readmitted: with new biases"}};
  const FaultRun run = fault_run(f, index, record);
  EXPECT_DOUBLE_EQ(run.horizontal_max_m, 5.0);
  EXPECT_NEAR(run.within_horizontal, (50.0 - begin_s) / (100.0 - begin_s), 0.01);
  EXPECT_EQ(run.within_vertical, 1.0);
  EXPECT_EQ(run.missed_alerts, 1);
  EXPECT_EQ(run.wrongly_excluded, std::vector<std::string>{"gps"});
  EXPECT_NEAR(run.excluded_after_s.value_or(-1.0), 4.0, 1e-5);
  EXPECT_NEAR(run.readmitted_after_s.value_or(-1.0), 99.0 - f.drill.stimuli[0].end_s(), 1e-5);
}

TEST(FaultMetrics, ALineOfTheFileIsReadAsItWasWritten) {
  const RandomFault f = random_fault(plan_of(1), 3);
  const FaultRun run = fault_run(f, 3, record_of(0.5));
  const std::string line = to_json_line(run);
  const Result<FaultRun> read = parse_json_line(line);
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(to_json_line(*read), line);
  EXPECT_FALSE(parse_json_line(line.substr(0, line.size() / 2)).ok());
  EXPECT_FALSE(parse_json_line("{}").ok());
}

TEST(FaultMetrics, TheTableHasARowForEachClassAndTheSum) {
  std::vector<FaultRun> runs;
  runs.reserve(4);
  for (int k = 0; k < 4; ++k) {
    runs.push_back(fault_run(random_fault(plan_of(1), k), k, record_of(k * 5.0)));
  }
  EXPECT_EQ(fault_table(runs).rows.size(), 5U);
  EXPECT_EQ(violation_table(runs, 10).rows.size(), 3U);
  EXPECT_EQ(violation_table(runs, 2).rows.size(), 2U);
  EXPECT_EQ(violation_table(runs, 2).rows[0][0], "3");
}

}  // namespace
}  // namespace rcs::drills

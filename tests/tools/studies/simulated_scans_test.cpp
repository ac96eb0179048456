#include "tools/studies/simulated_scans.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/sim/worlds.h"

namespace rcs::studies {
namespace {

sim::Scenario plain_drive() {
  sim::Scenario s;
  s.course.waypoints_world = {{0, 0}, {200, 0}};
  s.course.speed_mps = 8.0;
  s.world = sim::flat_world();
  s.beam = sim::ideal_beam();
  return s;
}

TEST(SimulatedScans, APlainIsFlatAndTheMotionMatchesTheVehicle) {
  const sim::Scenario scenario = plain_drive();
  const ScanSet set = simulate_scans(scenario, 2);
  ASSERT_EQ(set.pairs.size(), 4U);
  EXPECT_EQ(set.pairs[0].data, set.pairs[0].model + 1);
  EXPECT_EQ(set.pairs[1].data, set.pairs[1].model + kApart);
  for (const auto& [number, scan] : set.scans) {
    EXPECT_GT(scan.size(), 4900U) << number;  // the topmost rows are out of range
    const auto [low, high] = std::minmax_element(scan.z.begin(), scan.z.end());
    EXPECT_LT(*high - *low, 0.01F) << number;  // the body pitches little on a plain
    EXPECT_NEAR(*low, -1.8F, 0.02F) << number;
  }
  // The second model's scans are taken at full speed, straight on.
  EXPECT_LT((set.pairs[2].T_model_data.p - Vec3(0.8, 0.0, 0.0)).norm(), 1e-3);
  EXPECT_LT((set.pairs[3].T_model_data.p - Vec3(16.0, 0.0, 0.0)).norm(), 0.02);
}

TEST(SimulatedScans, AreDeskewed) {
  const ScanSet set = simulate_scans(plain_drive(), 2);
  const Points& scan = set.scans.at(set.pairs[2].model);
  // The middle of the lowest row points 19.69 deg down, and is measured when 1/32 of the scan is
  // over: 15/32 of 0.1 s before its middle, by when the vehicle has come nearer at 8 m/s.
  const double expected_m = 1.8 / std::tan(radians(19.6875)) - 8.0 * 0.1 * 15.0 / 32.0;
  double nearest_m = 1e9;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (std::abs(scan.y[i]) < 0.05F) nearest_m = std::min(nearest_m, double{scan.x[i]});
  }
  EXPECT_NEAR(nearest_m, expected_m, 0.05);  // the height of the body varies by 0.03 m
}

}  // namespace
}  // namespace rcs::studies

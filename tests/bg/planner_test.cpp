#include "modules/bg/planner.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/bg/fields.h"

namespace rcs::bg {
namespace {

/// Walls at 8 m from the goal at (14, 0) m.
vj::Terrain enclosure() {
  return test::level_field(128, [](double x, double y) {
    return std::abs(std::max(std::abs(x - 14.0), std::abs(y)) - 8.0) < 0.5;
  });
}

Stamp at(double t_s) { return Stamp(from_seconds(t_s)); }

TEST(Planner, EachTaskSearchesForAnEnclosedGoal) {
  const vj::Terrain terrain = enclosure();
  ObstacleDistance obstacles;
  obstacles.compute(terrain, {});
  Planner planner({}, {}, {}, 2.0);
  planner.note({}, terrain, obstacles);
  const Planner::Query query{terrain, obstacles, {}, {14.0, 0.0, 2.0}, std::nullopt};
  Path path;
  planner.plan(query, at(10.0), 2000, &path);
  EXPECT_EQ(planner.enclosed_since(), at(10.0));
  planner.plan(query, at(20.0), 2000, &path);
  EXPECT_EQ(planner.enclosed_since(), at(10.0));
  planner.begin_task();
  planner.plan(query, at(20.2), 2000, &path);
  EXPECT_EQ(planner.enclosed_since(), at(20.2));
}

// The place near the goal where the vehicle looks at it again is outside of the walls, and can
// always be reached: a vehicle that drives around them looks for ever.
TEST(Planner, TheTimeOfAnEnclosedGoalCountsWhileTheVehicleComesNoNearer) {
  const vj::Terrain terrain = enclosure();
  ObstacleDistance obstacles;
  obstacles.compute(terrain, {});
  Planner planner({}, {}, {}, 10.0);
  planner.note({}, terrain, obstacles);
  Path path;
  const auto plan = [&](double x_m, double y_m, double t_s) {
    Start start;
    start.place = {x_m, y_m, 0.0};
    planner.plan({terrain, obstacles, start, {14.0, 0.0, 2.0}, std::nullopt}, at(t_s), 2000, &path);
    return planner.enclosed_since();
  };
  EXPECT_EQ(plan(-4.0, 0.0, 10.0), at(10.0));
  EXPECT_GT(path.size(), 1U);
  EXPECT_EQ(plan(-1.0, 0.0, 12.0), at(12.0));
  EXPECT_EQ(plan(-0.5, 0.0, 14.0), at(12.0));
  EXPECT_EQ(plan(2.0, -6.0, 16.0), at(16.0));
  EXPECT_EQ(plan(8.0, -14.0, 20.0), at(16.0));
  EXPECT_EQ(plan(14.0, -14.0, 24.0), at(16.0));
}

}  // namespace
}  // namespace rcs::bg

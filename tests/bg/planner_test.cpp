#include "modules/bg/planner.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/bg/fields.h"

namespace rcs::bg {
namespace {

TEST(Planner, EachTaskSearchesForAnEnclosedGoal) {
  const vj::Terrain terrain = test::level_field(128, [](double x, double y) {
    return std::abs(std::max(std::abs(x - 14.0), std::abs(y)) - 8.0) < 0.5;
  });
  ObstacleDistance obstacles;
  obstacles.compute(terrain, {});
  Planner planner({}, {}, {}, 2.0);
  planner.note({}, terrain, obstacles);
  const Planner::Query query{terrain, obstacles, {}, {14.0, 0.0, 2.0}, std::nullopt};
  Path path;
  const auto at = [](double t_s) { return Stamp(from_seconds(t_s)); };
  planner.plan(query, at(10.0), 2000, &path);
  EXPECT_EQ(planner.enclosed_since(), at(10.0));
  planner.plan(query, at(20.0), 2000, &path);
  EXPECT_EQ(planner.enclosed_since(), at(10.0));
  planner.begin_task();
  planner.plan(query, at(20.2), 2000, &path);
  EXPECT_EQ(planner.enclosed_since(), at(20.2));
}

}  // namespace
}  // namespace rcs::bg

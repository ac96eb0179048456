#include "modules/bg/planner.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/bg/fields.h"

namespace rcs::bg {
namespace {

/// A goal at (14, 0) m within walls at 8 m from it.
class EnclosedGoal : public testing::Test {
 protected:
  explicit EnclosedGoal(double near_goal_m = 2.0) : planner_({}, {}, {}, near_goal_m) {
    obstacles_.compute(terrain_, {});
    planner_.note({}, terrain_, obstacles_);
  }
  /// @return since when the goal has been enclosed [s]
  double plan(double x_m, double y_m, double t_s) {
    Start start;
    start.place = {x_m, y_m, 0.0};
    planner_.plan({terrain_, obstacles_, start, {14.0, 0.0, 2.0}, std::nullopt},
                  Stamp(from_seconds(t_s)), 2000, &path_);
    return seconds(planner_.enclosed_since().time_since_epoch());
  }

  const vj::Terrain terrain_ = test::level_field(128, [](double x, double y) {
    return std::abs(std::max(std::abs(x - 14.0), std::abs(y)) - 8.0) < 0.5;
  });
  ObstacleDistance obstacles_;
  Planner planner_;
  Path path_;
};

TEST_F(EnclosedGoal, EachTaskSearchesForIt) {
  EXPECT_EQ(plan(0.0, 0.0, 10.0), 10.0);
  EXPECT_EQ(plan(0.0, 0.0, 20.0), 10.0);
  planner_.begin_task();
  EXPECT_EQ(plan(0.0, 0.0, 20.5), 20.5);
}

/// The place near the goal where the vehicle observes it again extends beyond the walls.
class GoalBehindWalls : public EnclosedGoal {
 protected:
  GoalBehindWalls() : EnclosedGoal(10.0) {}
};

// It can always be reached: a vehicle that drives around the walls would never end.
TEST_F(GoalBehindWalls, TheTimeCountsWhileTheVehicleComesNoNearer) {
  EXPECT_EQ(plan(-4.0, 0.0, 10.0), 10.0);
  EXPECT_GT(path_.size(), 1U);
  EXPECT_EQ(plan(-1.0, 0.0, 12.0), 12.0);
  EXPECT_EQ(plan(-0.5, 0.0, 14.0), 12.0);
  EXPECT_EQ(plan(2.0, -6.0, 16.0), 16.0);
  EXPECT_EQ(plan(8.0, -14.0, 20.0), 16.0);
  EXPECT_EQ(plan(14.0, -14.0, 24.0), 16.0);
}

}  // namespace
}  // namespace rcs::bg

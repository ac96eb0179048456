// Independently of its path, the vehicle does not drive into known obstacles.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "modules/bg/path_follow.h"
#include "modules/bg/path_search.h"
#include "modules/bg/required_clearance.h"
#include "modules/bg/trail.h"
#include "tests/bg/fields.h"

namespace rcs::bg {
namespace {

using test::level_field;

struct Vehicle {
  explicit Vehicle(const vj::Terrain& terrain) { obstacles.compute(terrain, weights); }
  /// On a path that turns with this curvature.
  [[nodiscard]] double free_m(const Pose2d& here, double speed_mps, double curvature_1pm,
                              int direction, double required_m = 0.2) const {
    Path path;
    Pose2d place = here;
    place.curvature_1pm = curvature_1pm;
    for (int k = 0; k < 60; ++k) {
      path.push_back({place, direction, 0.4 * k, 0.0, 0.0, std::abs(speed_mps)});
      place = along_arc(place, direction * 0.4);
    }
    return free_way(outline, obstacles, path, 0, here, speed_mps, direction, {}, shape, required_m,
                    20.0);
  }
  Shape shape;
  vj::Weights weights;
  Body outline{shape, weights.near_m};
  ObstacleDistance obstacles;
};

vj::Terrain wall_at(double x_m) {
  return level_field(128, [x_m](double x, double /*y*/) { return x > x_m && x < x_m + 1.0; });
}

TEST(FreeDistance, EndsBeforeAWall) {
  const Vehicle body(wall_at(10.0));
  // From the middle of the vehicle: half of its length, the margin, and the discs that cover the
  // outline and extend a little farther.
  const double ends_m = 10.0 - 1.6 - body.shape.min_margin_m;
  EXPECT_NEAR(body.free_m({0.0, 0.0, 0.0, 0.0}, 3.0, 0.0, 1), ends_m, 1.0);
  EXPECT_EQ(body.free_m({0.0, 0.0, 0.0, 0.0}, 3.0, 0.0, -1), 20.0);
  EXPECT_NEAR(body.free_m({0.0, 0.0, kPi, 0.0}, 3.0, 0.0, -1), ends_m, 1.0);
  EXPECT_EQ(body.free_m({0.0, 0.0, 0.5 * kPi, 0.0}, 3.0, 0.0, 1), 20.0);
}

TEST(FreeDistance, AccountsForTheSteeringRate) {
  const Vehicle body(wall_at(8.0));
  const Pose2d here{0.0, 0.0, 0.0, 0.0};
  const double slow_m = body.free_m(here, 0.5, 0.18, 1);
  const double fast_m = body.free_m(here, 6.0, 0.18, 1);
  EXPECT_EQ(slow_m, 20.0) << "the vehicle turns before the wall";
  EXPECT_LT(fast_m, 8.0) << "at 6 m/s the vehicle does not turn before the wall";
}

TEST(FreeDistance, FromTooCloseTheVehicleMayMoveAwayButNotCloser) {
  const Vehicle body(wall_at(1.9));
  const double clearance_m = body.outline.clearance(body.obstacles, {});
  RequiredClearance required(0.2);
  required.moved(clearance_m, true);
  EXPECT_LT(body.free_m({0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, 1, required.of(clearance_m)), 0.3);
  EXPECT_EQ(body.free_m({0.0, 0.0, 0.0, 0.0}, 0.0, 0.0, -1, required.of(clearance_m)), 20.0);
}

// A vehicle on a path with a bend before a wall drives on, where straight ahead it would not.
TEST(FreeDistance, FollowsThePath) {
  const Vehicle body(wall_at(9.0));
  const Pose2d here{0.0, 0.0, 0.0, 0.0};
  EXPECT_LT(body.free_m(here, 2.0, 0.0, 1), 8.0);
  EXPECT_EQ(body.free_m(here, 2.0, 0.18, 1), 20.0);
}

// With true squares for the cells and the true rectangle: never more than the clearance by 0.05 m,
// never less by more than the discs extend beyond the corners, and the rounding of the distances.
TEST(Body, ClearanceIsThatOfTheRectangle) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<> unit(0.0, 1.0);
  const Shape shape;
  const Body body(shape, 1.5);
  int near = 0;
  for (int k = 0; k < 300; ++k) {
    const double angle_rad = 2.0 * kPi * unit(rng);
    const double away_m = 1.5 + 2.5 * unit(rng);
    const vj::Terrain probe = level_field(64, [](double, double) { return false; });
    const Cell cell = probe.cell_at(away_m * std::cos(angle_rad), away_m * std::sin(angle_rad));
    const double x_m = (cell.i + 0.5) * probe.cell_m;
    const double y_m = (cell.j + 0.5) * probe.cell_m;
    ObstacleDistance obstacles;
    obstacles.compute(level_field(64,
                                  [&](double x, double y) {
                                    return std::abs(x - x_m) < 0.1 && std::abs(y - y_m) < 0.1;
                                  }),
                      {});
    const Pose2d place{0.0, 0.0, 2.0 * kPi * unit(rng), 0.0};
    const double c = std::cos(place.heading_rad);
    const double s = std::sin(place.heading_rad);
    double truth_m = 100.0;  // from the nearest point of the square to the rectangle
    for (double dx = -0.2; dx <= 0.2001; dx += 0.1) {
      for (double dy = -0.2; dy <= 0.2001; dy += 0.1) {
        const double ahead_m = std::abs(c * (x_m + dx) + s * (y_m + dy)) - 1.6;
        const double left_m = std::abs(c * (y_m + dy) - s * (x_m + dx)) - 1.0;
        truth_m = std::min(truth_m, std::hypot(std::max(0.0, ahead_m), std::max(0.0, left_m)));
      }
    }
    if (truth_m < 0.1 || truth_m > 1.2) continue;
    ++near;
    const double got_m = body.clearance(obstacles, place);
    EXPECT_LT(got_m, truth_m + 0.12);
    EXPECT_GT(got_m, truth_m - 0.25);
  }
  EXPECT_GT(near, 100);
}

// The clearance of an obstacle next to the vehicle hardly changes while the vehicle passes it.
TEST(Body, ClearanceIsSteadyWhileAnObstaclePasses) {
  const Body body(Shape{}, 1.5);
  ObstacleDistance obstacles;
  obstacles.compute(
      level_field(128, [](double x, double y) { return std::abs(x) < 0.3 && y > 0.8 && y < 1.2; }),
      {});
  double min_m = 10.0;
  double max_m = -10.0;
  for (double x_m = -1.0; x_m <= 1.0; x_m += 0.05) {
    const double clearance_m = body.clearance(obstacles, {x_m, -0.2, 0.0, 0.0});
    min_m = std::min(min_m, clearance_m);
    max_m = std::max(max_m, clearance_m);
  }
  EXPECT_LT(max_m - min_m, 0.1);
}

constexpr double kMargin_m = 0.3;
constexpr double kFloor_m = 0.15;

TEST(RequiredClearance, IsTheMarginFarFromObstacles) {
  RequiredClearance required(kMargin_m);
  required.begin(5.0);
  EXPECT_DOUBLE_EQ(required.of(5.0), kMargin_m);
  required.moved(0.46, false);
  EXPECT_DOUBLE_EQ(required.of(0.46), kMargin_m);
}

// Neither from cycle to cycle nor from path to path, however slowly it moves.
TEST(RequiredClearance, ByItsOwnMotionTheVehicleDoesNotComeNearerForEver) {
  RequiredClearance required(kMargin_m);
  required.begin(5.0);
  double clearance_m = 0.4;
  for (int cycle = 0; cycle < 1000; ++cycle) {
    clearance_m = std::max(clearance_m - 0.01, std::min(clearance_m, required.of(clearance_m)));
    required.moved(clearance_m, cycle % 5 == 0);
  }
  EXPECT_GT(clearance_m, kFloor_m - 0.2);
}

TEST(RequiredClearance, BelowTheFloorItStopsAndMayLeave) {
  RequiredClearance required(kMargin_m);
  required.begin(5.0);
  required.moved(0.0, false);
  EXPECT_DOUBLE_EQ(required.of(0.0), kFloor_m) << "no motion";
  required.moved(-0.02, true);
  EXPECT_NEAR(required.of(-0.02), -0.14, 1e-9);
  required.moved(0.08, false);
  EXPECT_NEAR(required.of(0.08), -0.04, 1e-9) << "it came away and may not return";
  required.moved(0.0, true);
  EXPECT_NEAR(required.of(0.0), -0.04, 1e-9);
  required.moved(0.2, false);
  EXPECT_DOUBLE_EQ(required.of(0.2), kFloor_m);
}

TEST(RequiredClearance, AnObstacleThatAppearsAllowsTheSameSlackAgain) {
  RequiredClearance required(kMargin_m);
  required.begin(5.0);
  required.map_changed(5.0, -0.5);
  EXPECT_NEAR(required.of(-0.5), -0.65, 1e-9);
  required.moved(-0.1, false);
  EXPECT_NEAR(required.of(-0.1), -0.25, 1e-9);
  required.moved(-0.2, false);
  EXPECT_NEAR(required.of(-0.2), -0.25, 1e-9) << "it came away and may not return";
  required.map_changed(-0.2, 3.0);
  EXPECT_DOUBLE_EQ(required.of(3.0), kMargin_m);
}

TEST(FreeDistance, TheSpeedAllowsStoppingWithinIt) {
  FollowParams params;
  EXPECT_EQ(speed_within(0.0, 2.0, params), 0.0);
  const double v = speed_within(4.0, 2.0, params);
  EXPECT_NEAR(params.latency_s * 2.0 + 0.5 * v * v / params.braking_mps2, 4.0, 1e-9);
}

TEST(MustBrake, WhereAnObstacleIsDetectedLate) {
  const FollowParams params;  // 0.25 s, 2.5 m/s2
  EXPECT_FALSE(must_brake(12.0, 6.0, params));
  EXPECT_FALSE(must_brake(8.8, 6.0, params));
  EXPECT_TRUE(must_brake(8.4, 6.0, params));
  EXPECT_TRUE(must_brake(0.0, 1.0, params));
  EXPECT_FALSE(must_brake(0.0, 0.4, params));
  EXPECT_TRUE(must_brake(0.0, -1.0, params));
}

TEST(PlanSpeeds, SpeedIsLimitedByTheSteeringRate) {
  const vj::Terrain terrain = level_field(128, [](double, double) { return false; });
  Shape shape;
  Path path;
  for (int k = 0; k < 40; ++k) {
    PathPoint p;
    p.s_m = 0.4 * k;
    p.place.x_m = p.s_m;
    p.place.curvature_1pm = k < 20 ? 0.05 : k < 23 ? 0.0 : -0.05;
    p.clearance_m = 50.0;
    path.push_back(p);
  }
  plan_speeds(terrain, {}, {}, {}, shape, 20.0, 1.0, &path);
  const double s_curve_mps = path[22].limit_mps;
  EXPECT_LE(s_curve_mps, shape.curvature_rate * 2.4 / 0.1 + 1e-9);
  EXPECT_GT(path[5].limit_mps, s_curve_mps);
}

TEST(Trail, IsKnownGroundAlsoInANewFrame) {
  const Shape shape;
  const auto unknown = [] {
    vj::Terrain t = level_field(128, [](double, double) { return false; });
    for (vj::Ground& g : t.ground) g.known = false;
    return t;
  };
  Trail trail;
  vj::Terrain terrain = unknown();
  trail.mark(shape, &terrain);
  EXPECT_FALSE(terrain.at(terrain.cell_at(0.0, 0.0)).known);
  for (int k = 0; k <= 100; ++k) trail.add({0.1 * k, 0.0, 0.0, 0.0});
  trail.mark(shape, &terrain);
  EXPECT_TRUE(terrain.at(terrain.cell_at(0.0, 0.0)).known);
  EXPECT_TRUE(terrain.at(terrain.cell_at(9.0, 0.9)).known);
  EXPECT_FALSE(terrain.at(terrain.cell_at(9.0, 1.5)).known);
  EXPECT_FALSE(terrain.at(terrain.cell_at(14.0, 0.0)).known);

  // The same vehicle, now at the origin with heading along y: it came from -y.
  trail.move_to_frame_of({0.0, 0.0, 0.5 * kPi, 0.0});
  vj::Terrain next = unknown();
  trail.mark(shape, &next);
  EXPECT_TRUE(next.at(next.cell_at(0.0, -9.0)).known);
  EXPECT_FALSE(next.at(next.cell_at(9.0, 0.0)).known);
}

TEST(Trail, LeadsBackAsFarAsTheVehicleCameAhead) {
  Trail trail;
  Path path;
  trail.lead_back(10.0, &path);
  EXPECT_TRUE(path.empty());
  // Backwards out of a lane, then 6 m ahead on an arc.
  for (int k = 0; k <= 50; ++k) trail.add({-0.1 * k, 0.0, 0.0, 0.0});
  Pose2d here{-5.0, 0.0, 0.0, 0.1};
  for (int k = 0; k < 60; ++k) {
    here = along_arc(here, 0.1);
    trail.add(here);
  }
  trail.lead_back(10.0, &path);
  ASSERT_GT(path.size(), 10U);
  EXPECT_NEAR(path.back().s_m, 6.0, 0.5);
  EXPECT_NEAR(path.back().place.x_m, -5.0, 0.5);
  for (std::size_t k = 0; k < path.size(); ++k) {
    EXPECT_EQ(path[k].direction, -1);
    if (k == 0 || k + 1 == path.size()) continue;
    EXPECT_NEAR(path[k].place.curvature_1pm, 0.1, 0.01);
  }
  trail.lead_back(2.0, &path);
  EXPECT_NEAR(path.back().s_m, 2.0, 0.41);
}

TEST(PathSearch, BacksUpOverKnownGroundOnly) {
  const vj::Weights weights;
  const Shape shape;
  PathSearch search{SearchParams{}, shape, weights};
  // A wall ahead, too near to turn; the goal is beyond it.
  const auto plan = [&](bool known_behind) {
    vj::Terrain terrain = level_field(
        128, [](double x, double y) { return x > 3.5 && x < 4.5 && std::abs(y) < 6.0; });
    for (int j = 0; j < 128; ++j) {
      for (int i = 0; i < 128; ++i) {
        const double x = (terrain.first.i + i + 0.5) * terrain.cell_m;
        if (!known_behind && x < -1.0) {
          terrain.ground[static_cast<std::size_t>(128 * j + i)].known = false;
        }
      }
    }
    ObstacleDistance obstacles;
    RememberedGround remembered;
    CostField field;
    const Goal goal{15.0, 0.0, 2.0};
    obstacles.compute(terrain, weights);
    remembered.note({}, terrain, obstacles, weights, search.body().radius_m() + shape.min_margin_m);
    FarCost beyond;
    beyond.compute(remembered, goal);
    field.compute(terrain, obstacles, beyond, goal, weights, search.body().radius_m(), 0.2);
    Path path;
    (void)search.search(terrain, obstacles, {}, {goal, &field}, std::nullopt, 6000, &path);
    double back_m = 0.0;
    for (const PathPoint& p : path) back_m = std::min(back_m, p.place.x_m);
    return back_m;
  };
  EXPECT_LT(plan(true), -1.0);
  EXPECT_GT(plan(false), -0.7);
}

}  // namespace
}  // namespace rcs::bg

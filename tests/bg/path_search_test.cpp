#include "modules/bg/path_search.h"

#include <gtest/gtest.h>

#include <random>

#include "modules/bg/path_follow.h"
#include "modules/bg/required_clearance.h"
#include "tests/bg/fields.h"

namespace rcs::bg {
namespace {

using test::level_field;

struct Planner {
  SearchParams params;
  Shape shape;
  vj::Weights weights;
  ObstacleDistance obstacles;
  RememberedGround remembered;
  CostField field;
  CostField onward_field;
  PathSearch search{params, shape, weights};

  SearchResult plan(const vj::Terrain& terrain, const Start& start, const Goal& goal, Path* path,
                    int granted = 6000) {
    compute(terrain, start, goal, &field);
    return search.search(terrain, obstacles, start, {goal, &field}, std::nullopt, granted, path);
  }
  SearchResult plan_through(const vj::Terrain& terrain, const Start& start, const Goal& goal,
                            const Goal& onward, Path* path) {
    compute(terrain, start, goal, &field);
    compute(terrain, start, onward, &onward_field);
    return search.search(terrain, obstacles, start, {goal, &field}, Target{onward, &onward_field},
                         params.max_expansions, path);
  }

 private:
  void compute(const vj::Terrain& terrain, const Start& start, const Goal& goal, CostField* out) {
    obstacles.compute(terrain, weights);
    remembered.note(start.place, terrain, obstacles, weights,
                    search.body().radius_m() + shape.min_margin_m);
    FarCost beyond;
    beyond.compute(remembered, goal);
    out->compute(terrain, obstacles, beyond, goal, weights, search.body().radius_m(),
                 start.required_m);
  }
};

TEST(ObstacleDistance, IsTheDistanceToTheNearestObstacle) {
  std::mt19937 rng(1);
  std::uniform_real_distribution<> unit(0.0, 1.0);
  const vj::Terrain terrain =
      level_field(64, [&](double /*x*/, double /*y*/) { return unit(rng) < 0.01; });
  ObstacleDistance obstacles;
  obstacles.compute(terrain, {});
  int exact = 0;
  int cells = 0;
  for (int j = 0; j < 64; ++j) {
    for (int i = 0; i < 64; ++i) {
      double nearest = ObstacleDistance::kFar_m;
      for (int b = 0; b < 64; ++b) {
        for (int a = 0; a < 64; ++a) {
          if (!terrain.ground[static_cast<std::size_t>(b * 64 + a)].obstacle) continue;
          nearest = std::min(nearest, (std::hypot(a - i, b - j) - 0.5) * 0.4);
        }
      }
      const double got = obstacles.in_cell(static_cast<std::size_t>(j * 64 + i));
      EXPECT_NEAR(got, std::max(0.0, nearest), 0.05);
      exact += std::abs(got - std::max(0.0, nearest)) < 1e-9 ? 1 : 0;
      ++cells;
    }
  }
  EXPECT_GT(exact, cells * 98 / 100);
}

TEST(PathSearch, GoesStraightWithoutObstacles) {
  Planner planner;
  Path path;
  const vj::Terrain terrain = level_field(128, [](double, double) { return false; });
  const SearchResult result = planner.plan(terrain, {}, {20.0, 0.0, 1.0}, &path);
  EXPECT_EQ(result.stop, SearchStop::kGoal);
  EXPECT_NEAR(path.back().s_m, 19.2, 1.3);
  for (const PathPoint& p : path) EXPECT_NEAR(p.place.y_m, 0.0, 0.3);
}

// A hillside across the straight way, 26 deg steep to the left, 5 m to either side.
vj::Terrain hillside() {
  vj::Terrain terrain = level_field(128, [](double, double) { return false; });
  for (int j = 0; j < terrain.height; ++j) {
    for (int i = 0; i < terrain.width; ++i) {
      const double x_m = terrain.cell_m * (terrain.first.i + i + 0.5);
      const double y_m = terrain.cell_m * (terrain.first.j + j + 0.5);
      if (x_m < 6.0 || x_m > 14.0 || std::abs(y_m) > 5.0) continue;
      vj::Ground& g = terrain.ground[static_cast<std::size_t>(j * terrain.width + i)];
      g.slope_rad = static_cast<float>(radians(26.0));
      g.rise_y = std::tan(g.slope_rad);
    }
  }
  return terrain;
}

double roll_at(const vj::Terrain& terrain, const Pose2d& p) {
  return std::abs(vj::roll_on(terrain.at(terrain.cell_at(p.x_m, p.y_m)), p.heading_rad));
}

TEST(PathSearch, NoPathRollsTheVehicleByMoreThanItsLimit) {
  Planner planner;
  Path path;
  const vj::Terrain terrain = hillside();
  const SearchResult result = planner.plan(terrain, {}, {20.0, 0.0, 1.5}, &path);
  EXPECT_EQ(result.stop, SearchStop::kGoal);
  for (const PathPoint& p : path) {
    EXPECT_LE(roll_at(terrain, p.place), planner.weights.max_roll_rad) << p.s_m;
  }
}

TEST(PathSearch, AVehicleThatRollsByMoreLeaves) {
  Planner planner;
  Path path;
  const vj::Terrain terrain = hillside();
  Start start;
  start.place = {10.0, 0.0, 0.0, 0.0};
  const SearchResult result = planner.plan(terrain, start, {20.0, 0.0, 1.5}, &path);
  EXPECT_EQ(result.stop, SearchStop::kGoal);
  ASSERT_GT(path.size(), 10U);
  EXPECT_LT(planner.search.cost_of_rest(path, 20, terrain, planner.obstacles,
                                        {{20.0, 0.0, 1.5}, &planner.field}, std::nullopt),
            50.0)
      << "the rest of the path is on level ground";
}

// A wall with a gap to one side: the path goes through the gap, and the body never comes nearer to
// the wall than the margin, measured with the true rectangle and the cells' true squares.
TEST(PathSearch, GoesAroundAnObstacleAndKeepsTheMargin) {
  Planner planner;
  Path path;
  const auto wall = [](double x, double y) { return x > 9.0 && x < 10.0 && y > -12.0 && y < 6.0; };
  const vj::Terrain terrain = level_field(128, wall);
  const SearchResult result = planner.plan(terrain, {}, {20.0, 0.0, 1.5}, &path);
  ASSERT_EQ(result.stop, SearchStop::kGoal);
  for (const PathPoint& p : path) {
    const double c = std::cos(p.place.heading_rad);
    const double s = std::sin(p.place.heading_rad);
    for (double u = -1.6; u <= 1.6; u += 0.1) {
      for (double v = -1.0; v <= 1.0; v += 0.1) {
        const Cell cell = terrain.cell_at(p.place.x_m + c * u - s * v, p.place.y_m + s * u + c * v);
        ASSERT_FALSE(terrain.at(cell).obstacle) << "at " << p.s_m << " m";
      }
    }
    EXPECT_GE(p.clearance_m, planner.weights.margin_m - 1e-6);
  }
  for (std::size_t k = 1; k < path.size(); ++k) {
    EXPECT_LE(std::abs(path[k].place.curvature_1pm), planner.shape.max_curvature_1pm + 1e-9);
    EXPECT_LT(std::hypot(path[k].place.x_m - path[k - 1].place.x_m,
                         path[k].place.y_m - path[k - 1].place.y_m),
              0.41);
  }
}

TEST(PathSearch, BacksOutOfADeadEnd) {
  Planner planner;
  Path path;
  // A narrow lane, open behind the vehicle only.
  const auto walls = [](double x, double y) {
    const bool sides = std::abs(y) > 2.0 && std::abs(y) < 3.0 && x > -6.0 && x < 5.0;
    return sides || (x > 4.0 && x < 5.0 && std::abs(y) < 3.0);
  };
  const vj::Terrain terrain = level_field(128, walls);
  const SearchResult result = planner.plan(terrain, {}, {15.0, 0.0, 1.5}, &path, 6000);
  ASSERT_NE(result.stop, SearchStop::kNoWay);
  EXPECT_EQ(path[1].direction, -1);
}

// A path that reversed at once would lead the vehicle over the ground that it has just seen.
TEST(PathSearch, AMovingVehicleReversesNoSoonerThanItCanStop) {
  Planner planner;
  Path path;
  const vj::Terrain open = level_field(128, [](double, double) { return false; });
  const Goal behind{-8.0, 0.0, 1.5};
  ASSERT_NE(planner.plan(open, {{}, 1, 0.0}, behind, &path).stop, SearchStop::kNoWay);
  EXPECT_EQ(path[1].direction, -1);
  ASSERT_NE(planner.plan(open, {{}, 1, 5.0}, behind, &path).stop, SearchStop::kNoWay);
  for (const PathPoint& p : path) {
    EXPECT_TRUE(p.s_m > 5.0 || p.direction == 1) << "at " << p.s_m << " m";
  }
  // Where it cannot stop there is no path.
  const vj::Terrain wall = level_field(128, [](double x, double) { return x > 5.0 && x < 6.0; });
  EXPECT_NE(planner.plan(wall, {{}, 1, 2.0}, behind, &path).stop, SearchStop::kNoWay);
  EXPECT_EQ(planner.plan(wall, {{}, 1, 6.0}, behind, &path).stop, SearchStop::kNoWay);
}

// A trunk may stand where nothing was seen: that ground is neither driven over nor approached
// without need.
TEST(PathSearch, ReversingTowardsUnseenGroundCostsMoreAndEndsBeforeIt) {
  Planner planner;
  Path path;
  const double rear_m = 0.5 * planner.shape.length_m;
  const Goal behind{-4.0, 0.0, 1.5};
  const auto cost_with_unseen_beyond = [&](double x_m) {
    vj::Terrain terrain =
        level_field(128, [](double x, double y) { return std::abs(y) > 2.5 || x > 4.0; });
    for (std::size_t k = 0; k < terrain.ground.size(); ++k) {
      const double x = (terrain.first.i + static_cast<int>(k) % 128 + 0.5) * terrain.cell_m;
      terrain.ground[k].known = x > x_m;
    }
    const SearchResult result = planner.plan(terrain, {}, behind, &path);
    if (result.stop != SearchStop::kGoal) return CostField::kNoWay;
    EXPECT_EQ(path[1].direction, -1);
    return result.cost;
  };
  const double far = cost_with_unseen_beyond(-8.0 - rear_m);
  EXPECT_EQ(cost_with_unseen_beyond(-1.5 - rear_m), CostField::kNoWay);
  // The farther the unseen ground, the cheaper; there is a place where it is near but not below.
  double last = CostField::kNoWay;
  double dearest = 0.0;
  for (double beyond_m = -2.0; beyond_m > -6.0; beyond_m -= 0.1) {
    const double cost = cost_with_unseen_beyond(beyond_m - rear_m);
    EXPECT_LE(cost, last + 1e-9) << beyond_m;
    last = cost;
    if (cost < CostField::kNoWay) dearest = std::max(dearest, cost);
  }
  EXPECT_NEAR(last, far, 1e-9);
  EXPECT_GT(dearest, far + 0.1 * planner.weights.within_margin);
}

// A lane wide enough for the covering discs and 0.2 m on each side, not for 0.4 m: it is driven
// through, but a way around that is not much longer is preferred.
TEST(PathSearch, AWayAroundIsPreferredToANarrowLane) {
  Planner planner;
  Path path;
  const double half_m = planner.search.body().radius_m() + 0.35;
  const Pose2d start{0.0, 0.2, 0.0, 0.0};
  // With a yard around the start there is no other way.
  const auto lane = [&](double wall_m, bool yard) {
    return level_field(128, [&, wall_m, yard](double x, double y) {
      const double aside_m = std::abs(y - 0.2);
      if (yard && x < 8.0 && (x < -8.0 || aside_m > 12.0)) return true;
      return x > 4.0 && x < 8.0 && aside_m > half_m + 0.1 && aside_m < wall_m;
    });
  };
  const auto widest_m = [&path] {
    double out = 0.0;
    for (const PathPoint& p : path) out = std::max(out, std::abs(p.place.y_m));
    return out;
  };
  ASSERT_EQ(planner.plan(lane(100.0, true), {start}, {20.0, 0.2, 1.5}, &path).stop,
            SearchStop::kGoal);
  EXPECT_LT(widest_m(), 1.0);
  ASSERT_NE(planner.plan(lane(6.0, false), {start}, {20.0, 0.2, 1.5}, &path).stop,
            SearchStop::kNoWay);
  EXPECT_GT(widest_m(), 6.0);
}

// The search can drive through every gap that its heuristic considers passable. Otherwise it would
// get stuck at a gap that is too narrow and search for no alternative.
TEST(CostField, ATooNarrowGapIsImpassable) {
  Planner planner;
  Path path;
  const auto wall = [](double x, double y) {
    return x > 9.0 && x < 10.0 && y < 8.0 && (y < -1.2 || y > 1.2);
  };
  const vj::Terrain terrain = level_field(128, wall);
  ASSERT_NE(planner.plan(terrain, {}, {20.0, 0.0, 1.5}, &path).stop, SearchStop::kNoWay);
  EXPECT_TRUE(planner.field.blocked(9.5, 0.0));
  double max_y_m = 0.0;
  for (const PathPoint& p : path) max_y_m = std::max(max_y_m, p.place.y_m);
  EXPECT_GT(max_y_m, 8.0);
}

// Between two waypoints the vehicle need not stop: the path leads through the first one.
TEST(PathSearch, LeadsThroughAWaypointTowardsTheNextOne) {
  Planner planner;
  Path path;
  const vj::Terrain open = level_field(128, [](double, double) { return false; });
  const Goal first{12.0, 0.0, 1.5};
  const Goal next{12.0, 15.0, 1.5};
  ASSERT_EQ(planner.plan_through(open, {}, first, next, &path).stop, SearchStop::kGoal);
  double nearest_m = 100.0;
  for (const PathPoint& p : path) {
    nearest_m = std::min(nearest_m, std::hypot(p.place.x_m - 12.0, p.place.y_m));
    EXPECT_EQ(p.direction, 1);
  }
  EXPECT_LT(nearest_m, first.radius_m);
  EXPECT_LT(std::hypot(path.back().place.x_m - 12.0, path.back().place.y_m - 15.0), next.radius_m);
  // The second one farther away than the horizon.
  ASSERT_EQ(planner.plan_through(open, {}, first, {12.0, 60.0, 1.5}, &path).stop,
            SearchStop::kHorizon);
  EXPECT_GT(path.back().place.y_m, 10.0);
}

TEST(PathSearch, ReportsThatNoPathExists) {
  Planner planner;
  Path path;
  const auto ring = [](double x, double y) {
    const double r = std::hypot(x, y);
    return r > 5.0 && r < 6.0;
  };
  const vj::Terrain terrain = level_field(128, ring);
  const SearchResult result = planner.plan(terrain, {}, {15.0, 0.0, 1.5}, &path);
  EXPECT_EQ(result.stop, SearchStop::kNoWay);
  EXPECT_TRUE(path.empty());
}

TEST(PathSearch, StopsAtItsGrant) {
  Planner planner;
  Path path;
  const auto wall = [](double x, double y) { return x > 9.0 && x < 10.0 && std::abs(y) < 15.0; };
  const SearchResult result = planner.plan(level_field(128, wall), {}, {20.0, 0.0, 1.5}, &path, 40);
  EXPECT_EQ(result.stop, SearchStop::kBudget);
  EXPECT_LE(result.expansions, 40);
  EXPECT_FALSE(path.empty());
}

TEST(PathSearch, LeavesAnObstacleThatItTouches) {
  Planner planner;
  Path path;
  const auto beside = [](double x, double y) { return x > -1.0 && x < 1.0 && y > 0.9 && y < 1.5; };
  const vj::Terrain terrain = level_field(128, beside);
  planner.obstacles.compute(terrain, planner.weights);
  RequiredClearance required(planner.shape.min_margin_m);
  const double clearance_m = planner.search.body().clearance(planner.obstacles, {});
  required.begin(clearance_m);
  const Start start{{}, 0, 0.0, required.of(clearance_m)};
  const SearchResult result = planner.plan(terrain, start, {15.0, 0.0, 1.5}, &path);
  EXPECT_EQ(result.stop, SearchStop::kGoal);
  EXPECT_LT(path.front().clearance_m, 0.0);
  EXPECT_GT(path.back().clearance_m, 0.5);
}

TEST(PathFollow, SpeedsRespectBrakingAndEndAtZero) {
  Planner planner;
  Path path;
  const vj::Terrain terrain = level_field(128, [](double, double) { return false; });
  planner.plan(terrain, {}, {20.0, 3.0, 1.0}, &path);
  const FollowParams params;
  const vj::SpeedParams speeds;
  plan_speeds(terrain, planner.weights, speeds, params, planner.shape, 6.0, 1.0, &path);
  EXPECT_EQ(path.back().speed_mps, 0.0);
  for (std::size_t k = 1; k < path.size(); ++k) {
    const double v0 = path[k - 1].speed_mps;
    const double v1 = path[k].speed_mps;
    EXPECT_LE(v0, 6.0);
    EXPECT_LE(v0 * v0 - v1 * v1,
              2.0 * params.braking_mps2 * (path[k].s_m - path[k - 1].s_m) + 1e-9);
  }
}

// Of a straight path of 50 m, each time with one more limit, the lowest one.
TEST(PathFollow, EachSpeedHasTheCauseOfTheLowestLimit) {
  const Planner planner;
  vj::Terrain terrain = level_field(128, [](double, double) { return false; });
  vj::SpeedParams speeds;
  speeds.sight_mps = 30.0;
  Path path(100);
  for (std::size_t k = 0; k < path.size(); ++k) {
    path[k].place.x_m = path[k].s_m = 0.2 * static_cast<double>(k);
    path[k].clearance_m = 10.0;
  }
  const std::size_t middle = 40;
  const auto cause = [&](double share = 1.0) {
    plan_speeds(terrain, planner.weights, speeds, {}, planner.shape, 5.0, share, &path);
    return path[middle].cause;
  };
  EXPECT_EQ(cause(), vj::SpeedCause::kTask);
  EXPECT_EQ(path.back().cause, vj::SpeedCause::kEnd);
  EXPECT_EQ(path[path.size() - 2].cause, vj::SpeedCause::kEnd) << "it brakes for the end";
  EXPECT_EQ(cause(0.9), vj::SpeedCause::kUncertainty);
  speeds.sight_mps = 4.5;
  EXPECT_EQ(cause(), vj::SpeedCause::kSight);
  path[middle].place.curvature_1pm = 0.18;
  EXPECT_EQ(cause(), vj::SpeedCause::kSteering) << "the wheels turn there and back";
  for (PathPoint& p : path) p.place.curvature_1pm = 0.18;
  EXPECT_EQ(cause(), vj::SpeedCause::kTurn);
  path[middle].zone_mps = 2.5;
  EXPECT_EQ(cause(), vj::SpeedCause::kZone);
  EXPECT_EQ(path[middle - 1].cause, vj::SpeedCause::kZone) << "before it, it brakes for it";
  path[middle].clearance_m = 0.0;
  EXPECT_EQ(cause(), vj::SpeedCause::kClearance);
  path[middle].direction = -1;
  path[middle].clearance_m = 10.0;
  EXPECT_EQ(cause(), vj::SpeedCause::kEnd) << "it stops to change its direction";
}

// What an edge hides is seen from a few metres only, whatever the ground and the command allow.
TEST(PathFollow, NoSpeedIsLargerThanTheSightAllows) {
  Planner planner;
  Path path;
  const vj::Terrain terrain = level_field(128, [](double, double) { return false; });
  planner.plan(terrain, {}, {22.0, 0.0, 1.0}, &path);
  vj::SpeedParams speeds;
  const auto fastest = [&](double share) {
    plan_speeds(terrain, planner.weights, speeds, {}, planner.shape, 20.0, share, &path);
    double out = 0.0;
    for (const PathPoint& p : path) out = std::max(out, p.limit_mps);
    return out;
  };
  EXPECT_DOUBLE_EQ(fastest(1.0), speeds.sight_mps);
  EXPECT_DOUBLE_EQ(fastest(0.8), speeds.sight_mps) << "the share is that of the other limits";
  speeds.sight_mps = 30.0;
  EXPECT_DOUBLE_EQ(fastest(1.0), speeds.smooth_mps);
}

// A kinematic vehicle with delayed actuators follows the path to its end.
TEST(PathFollow, AVehicleStaysOnItsPath) {
  Planner planner;
  Path path;
  const auto wall = [](double x, double y) { return x > 9.0 && x < 10.0 && y > -12.0 && y < 6.0; };
  const vj::Terrain terrain = level_field(128, wall);
  planner.plan(terrain, {}, {20.0, 0.0, 1.5}, &path);
  const FollowParams params;
  plan_speeds(terrain, planner.weights, {}, params, planner.shape, 5.0, 1.0, &path);
  Pose2d vehicle;
  double speed = 0.0;
  std::size_t at = 0;
  double worst = 0.0;
  bool arrived = false;
  Steering asked;
  Steering delayed[3];
  for (int step = 0; step < 2000 && !arrived; ++step) {
    asked = follow(path, vehicle, speed, params, planner.shape, &at);
    worst = std::max(worst, std::abs(asked.off_m));
    arrived = asked.at_end && speed < 0.1;
    delayed[2] = delayed[1];
    delayed[1] = delayed[0];
    delayed[0] = asked;
    speed += std::clamp(delayed[2].speed_mps - speed, -0.1, 0.1);
    vehicle.curvature_1pm +=
        std::clamp(delayed[2].curvature_1pm - vehicle.curvature_1pm, -0.0125, 0.0125);
    vehicle = along_arc(vehicle, speed * 0.05);
  }
  EXPECT_TRUE(arrived);
  EXPECT_LT(worst, 0.6);
}

}  // namespace
}  // namespace rcs::bg

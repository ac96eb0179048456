#include "modules/bg/path_smoothing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/bg/fields.h"

namespace rcs::bg {
namespace {

using test::level_field;

struct Smoothing {
  Shape shape;
  vj::Weights weights;
  Body body{shape, weights.near_m};
  ObstacleDistance obstacles;

  explicit Smoothing(const vj::Terrain& terrain) { obstacles.compute(terrain, weights); }

  /// Arcs of 1.2 m with these shares of the largest curvature, as the search makes them.
  [[nodiscard]] Path arcs(const std::vector<double>& shares, int direction = 1) const {
    Path path;
    Pose2d place;
    path.push_back({place, direction, 0.0, body.clearance(obstacles, place), 0.0, 0.0});
    for (const double share : shares) {
      place.curvature_1pm = share * shape.max_curvature_1pm;
      for (int k = 0; k < 3; ++k) {
        place = along_arc(place, direction * 0.4);
        path.push_back(
            {place, direction, path.back().s_m + 0.4, body.clearance(obstacles, place), 0.0, 0.0});
      }
    }
    return path;
  }
  void smooth(Path* path, const std::optional<Goal>& through = std::nullopt) const {
    bg::smooth(body, obstacles, shape, weights, through, path);
  }
};

// Largest change of the curvature within 2.4 m, as the planned speeds are limited by it.
double steering(const Path& path) {
  double out = 0.0;
  for (std::size_t k = 0; k < path.size(); ++k) {
    for (std::size_t i = k; i < path.size() && path[i].s_m - path[k].s_m <= 2.4; ++i) {
      out = std::max(out, std::abs(path[i].place.curvature_1pm - path[k].place.curvature_1pm));
    }
  }
  return out;
}

const std::vector<double> kZigzag = {0.0, 0.0, 0.5,  -0.5, 0.5, 0.0, -0.5,
                                     0.5, 0.0, -0.5, 0.5,  0.0, 0.0};

TEST(PathSmoothing, AZigzagBecomesDrivableWithoutSlowingDown) {
  const Smoothing s(level_field(128, [](double, double) { return false; }));
  const Path before = s.arcs(kZigzag);
  Path path = before;
  s.smooth(&path);
  ASSERT_EQ(path.size(), before.size());
  EXPECT_LT(steering(path), 0.25 * steering(before));
  for (std::size_t k = 0; k < path.size(); ++k) {
    const double moved_m = std::hypot(path[k].place.x_m - before[k].place.x_m,
                                      path[k].place.y_m - before[k].place.y_m);
    EXPECT_LT(moved_m, 0.5) << k;
  }
  for (const std::size_t k : {std::size_t{0}, path.size() - 1}) {
    EXPECT_DOUBLE_EQ(path[k].place.x_m, before[k].place.x_m);
    EXPECT_DOUBLE_EQ(path[k].place.heading_rad, before[k].place.heading_rad);
  }
  EXPECT_NEAR(path.back().s_m, before.back().s_m, 0.3);
}

TEST(PathSmoothing, HeadingAndCurvatureAreThoseOfThePoints) {
  const Smoothing s(level_field(128, [](double, double) { return false; }));
  Path path = s.arcs({0.0, 0.0, 0.25, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.25, 0.0, 0.0});
  s.smooth(&path);
  for (std::size_t k = 4; k + 4 < path.size(); ++k) {
    const Pose2d& p = path[k].place;
    Pose2d next = p;
    next.curvature_1pm = 0.5 * (p.curvature_1pm + path[k + 1].place.curvature_1pm);
    next = along_arc(next, path[k + 1].s_m - path[k].s_m);
    EXPECT_NEAR(next.x_m, path[k + 1].place.x_m, 0.01) << k;
    EXPECT_NEAR(next.y_m, path[k + 1].place.y_m, 0.01) << k;
    EXPECT_NEAR(next.heading_rad, path[k + 1].place.heading_rad, 0.01) << k;
  }
}

TEST(PathSmoothing, KeepsTheMarginAndTheCurvatureOfTheVehicle) {
  std::mt19937 rng(5);
  std::uniform_real_distribution<> unit(0.0, 1.0);
  int smoothed = 0;
  for (int field = 0; field < 50; ++field) {
    const Smoothing s(level_field(
        128, [&](double x, double y) { return std::hypot(x, y) > 4.0 && unit(rng) < 0.01; }));
    std::vector<double> shares = {0.0, 0.0};
    for (int k = 0; k < 15; ++k) shares.push_back(0.25 * std::floor(9.0 * unit(rng)) - 1.0);
    const Path before = s.arcs(shares);
    Path path = before;
    s.smooth(&path);
    for (std::size_t k = 0; k < path.size(); ++k) {
      const double min_m = std::min(s.weights.margin_m, before[k].clearance_m - 0.021);
      EXPECT_GE(s.body.clearance(s.obstacles, path[k].place), min_m) << field << " " << k;
      EXPECT_LE(std::abs(path[k].place.curvature_1pm), 1.021 * s.shape.max_curvature_1pm);
    }
    smoothed += steering(path) < 0.9 * steering(before) ? 1 : 0;
  }
  EXPECT_GT(smoothed, 20);
}

double sharpest(const Path& path) {
  double out = 0.0;
  for (const PathPoint& p : path) out = std::max(out, std::abs(p.place.curvature_1pm));
  return out;
}

// Around an obstacle 10 m ahead and back, as the search drives it: by half of the curvature.
const std::vector<double> kSwerve = {0.0, 0.0, 0.5, 0.5, 0.0, 0.0, -0.5, -0.5, -0.5, -0.5,
                                     0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0,  0.0,  0.0,  0.0};

double farthest_m(const Path& path, const Path& before) {
  double out = 0.0;
  for (std::size_t k = 0; k < path.size(); ++k) {
    out = std::max(out, std::hypot(path[k].place.x_m - before[k].place.x_m,
                                   path[k].place.y_m - before[k].place.y_m));
  }
  return out;
}

TEST(PathSmoothing, AWideSwerveOnOpenGroundBecomesAGentleCurve) {
  const Smoothing s(level_field(128, [](double, double) { return false; }));
  const Path before = s.arcs(kSwerve);
  Path path = before;
  s.smooth(&path);
  EXPECT_LT(sharpest(path), 0.6 * sharpest(before));
  EXPECT_GT(farthest_m(path, before), 0.5);
}

TEST(PathSmoothing, BesideAnObstacleThePathStaysWhereTheSearchLaidIt) {
  // Beside the begin: no gentler curve would lead there.
  const Smoothing s(
      level_field(128, [](double x, double y) { return std::hypot(x - 1.0, y + 2.5) < 0.5; }));
  const Path before = s.arcs(kSwerve);
  Path path = before;
  s.smooth(&path);
  EXPECT_LT(farthest_m(path, before), 0.25);
  EXPECT_GT(sharpest(path), 0.8 * sharpest(before));
  EXPECT_LT(steering(path), steering(before));
}

TEST(PathSmoothing, ContinuesToLeadThroughAGoal) {
  const Smoothing s(level_field(128, [](double, double) { return false; }));
  const Path before = s.arcs(kSwerve);
  const Pose2d& top = before[24].place;  // of the swerve
  const Goal goal{top.x_m, top.y_m + 0.3, 0.8};
  const auto nearest_m = [&goal](const Path& path) {
    double out = 1e9;
    for (const PathPoint& p : path) {
      out = std::min(out, std::hypot(p.place.x_m - goal.x_m, p.place.y_m - goal.y_m));
    }
    return out;
  };
  Path freely = before;
  s.smooth(&freely);
  EXPECT_GT(nearest_m(freely), 0.8 * goal.radius_m);
  Path through = before;
  s.smooth(&through, goal);
  EXPECT_LE(nearest_m(through), 0.8 * goal.radius_m);
  EXPECT_LT(steering(through), steering(before));
}

TEST(PathSmoothing, LegsBackAndShortLegsStay) {
  const Smoothing s(level_field(128, [](double, double) { return false; }));
  for (const Path& before : {s.arcs(kZigzag, -1), s.arcs({0.5, -0.5})}) {
    Path path = before;
    s.smooth(&path);
    for (std::size_t k = 0; k < path.size(); ++k) {
      EXPECT_DOUBLE_EQ(path[k].place.y_m, before[k].place.y_m);
    }
  }
}

}  // namespace
}  // namespace rcs::bg

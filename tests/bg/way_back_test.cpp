#include "modules/bg/way_back.h"

#include <gtest/gtest.h>

#include "tests/bg/fields.h"

namespace rcs::bg {
namespace {

constexpr double kMax_m = 30.0;

/// Places each 3 m on a circle to the left of the origin, which it leaves along x.
std::vector<Vec2> circle(double radius_m, int places) {
  std::vector<Vec2> line;
  for (int k = 0; k < places; ++k) {
    const double turn = 3.0 * k / radius_m;
    line.emplace_back(radius_m * std::sin(turn), radius_m * (1.0 - std::cos(turn)));
  }
  return line;
}

/// Places each 2 m or less on a straight line.
std::vector<Vec2> straight(const Vec2& from, const Vec2& to) {
  const int n = static_cast<int>(std::ceil((to - from).norm() / 2.0));
  std::vector<Vec2> line;
  for (int k = 0; k <= n; ++k) line.emplace_back(from + (to - from) * (k / static_cast<double>(n)));
  return line;
}

Path path_on(const std::vector<Vec2>& line, const Pose2d& vehicle, double max_m = kMax_m) {
  Path path;
  follow_way_back(line, vehicle, Shape{}, max_m, &path);
  return path;
}

TEST(WayBack, TheCurveThroughThePlacesIsThatOfTheWay) {
  const double radius_m = 8.0;
  const Path path = path_on(circle(radius_m, 12), Pose2d{});
  ASSERT_GT(path.size(), 50U);
  EXPECT_NEAR(path.back().s_m, kMax_m, 0.5);
  // The ends of the line are extended straight.
  for (std::size_t k = 10; k + 10 < path.size(); ++k) {
    const Pose2d& p = path[k].place;
    EXPECT_NEAR(std::hypot(p.x_m, p.y_m - radius_m), radius_m, 0.02) << k;
    EXPECT_NEAR(std::remainder(p.heading_rad - path[k].s_m / radius_m, 2.0 * kPi), 0.0, 0.03) << k;
    EXPECT_NEAR(p.curvature_1pm, 1.0 / radius_m, 0.03) << k;
    EXPECT_LT(path[k + 1].s_m - path[k].s_m, 0.45);
  }
}

TEST(WayBack, ItBeginsAtThePointNearestToTheVehicle) {
  const Path path = path_on(circle(1e6, 12), {10.3, 0.4, 0.1, 0.0});
  ASSERT_FALSE(path.empty());
  EXPECT_NEAR(path.front().place.x_m, 10.3, 0.2);
  EXPECT_NEAR(path.back().place.x_m, 33.0, 1e-6) << "and ends at the last place";
  EXPECT_EQ(path.front().s_m, 0.0);
}

TEST(WayBack, AVehicleThatIsBesideItOrTurnedAwayHasToFindAWayToIt) {
  const std::vector<Vec2> line = circle(1e6, 12);
  EXPECT_TRUE(path_on(line, {10.0, 1.0, 0.0, 0.0}).empty());
  EXPECT_TRUE(path_on(line, {10.0, 0.0, 0.7, 0.0}).empty());
  EXPECT_TRUE(path_on(line, {10.0, 0.0, kPi, 0.0}).empty());
  EXPECT_TRUE(path_on({}, {}).empty());
  EXPECT_TRUE(path_on({Vec2::Zero()}, {}).empty());
}

TEST(WayBack, ItEndsWhereTheVehicleCannotTurnSoSharply) {
  std::vector<Vec2> line = circle(1e6, 6);  // 15 m, and then to the left
  for (int k = 1; k < 6; ++k) line.emplace_back(15.0, 3.0 * k);
  const Path path = path_on(line, {});
  ASSERT_FALSE(path.empty());
  EXPECT_LT(path.back().place.x_m, 15.0);
  EXPECT_GT(path.back().place.x_m, 10.0);
}

TEST(WayBack, GroundIsMarkedByItsDistanceFromTheLine) {
  vj::Terrain terrain = test::level_field(64, [](double, double) { return false; });
  mark_way_back({{-8.0, 0.0}, {0.0, 0.0}, {0.0, 8.0}}, Shape{}, vj::Weights{}, &terrain);
  const auto off_m = [&terrain](double x_m, double y_m) {
    return terrain.at(terrain.cell_at(x_m, y_m)).off_route_m;
  };
  EXPECT_NEAR(off_m(-4.2, 0.2), 0.2, 1e-3);
  EXPECT_NEAR(off_m(-4.2, 1.0), 1.0, 1e-3);
  EXPECT_NEAR(off_m(1.4, 4.2), 1.4, 1e-3);
  EXPECT_EQ(off_m(6.2, -6.2), 2.0F);
  mark_way_back({}, Shape{}, vj::Weights{}, &terrain);
  EXPECT_EQ(off_m(-4.2, 0.2), 2.0F) << "nothing remains of a former line";
}

TEST(WayBack, GroundThatWasDrivenOverIsFreeUnlessSomethingStandsThereNow) {
  vj::Terrain terrain = test::level_field(64, [](double x_m, double) { return x_m > 0.0; });
  for (vj::Ground& g : terrain.ground) g.step_m = g.obstacle ? 0.25F : 0.0F;
  const auto at = [&terrain](double x_m, double y_m) -> vj::Ground& {
    return terrain.ground[terrain.index(terrain.cell_at(x_m, y_m))];
  };
  at(3.0, 0.2).step_m = 1.6F;  // a person
  at(-3.0, 0.2).slope_rad = 0.8F;
  at(4.2, 0.2).step_m = 0.0F;  // hidden by an edge
  mark_way_back(straight({-8.0, 0.0}, {8.0, 0.0}), Shape{}, vj::Weights{}, &terrain);
  EXPECT_FALSE(at(2.2, 0.2).obstacle);
  EXPECT_TRUE(at(3.0, 0.2).obstacle);
  EXPECT_TRUE(at(4.2, 0.2).obstacle) << "nothing was observed there";
  EXPECT_TRUE(at(2.2, 2.2).obstacle) << "beside the way";
  EXPECT_TRUE(vj::passable(at(-3.0, 0.2), vj::Weights{}));
}

// Places that are far apart: the vehicle was not localized between them, or the places of a return
// that was given up precede them.
TEST(WayBack, BetweenPlacesThatAreFarApartNothingWasDrivenOver) {
  vj::Terrain terrain = test::level_field(64, [](double, double) { return true; });
  for (vj::Ground& g : terrain.ground) g.step_m = 0.25F;
  std::vector<Vec2> line = straight({-10.0, 0.0}, {-4.0, 0.0});
  for (const Vec2& p : straight({4.0, 0.0}, {10.0, 0.0})) line.push_back(p);
  mark_way_back(line, Shape{}, vj::Weights{}, &terrain);
  const auto is_obstacle = [&terrain](double x_m) {
    return terrain.at(terrain.cell_at(x_m, 0.2)).obstacle;
  };
  EXPECT_FALSE(is_obstacle(-6.2));
  EXPECT_TRUE(is_obstacle(0.2));
  EXPECT_FALSE(is_obstacle(6.2));

  const Path path = path_on(line, {-9.0, 0.1, 0.0, 0.0});
  ASSERT_FALSE(path.empty());
  EXPECT_NEAR(path.back().place.x_m, -4.0, 1e-6);
  for (const PathPoint& p : path) EXPECT_NEAR(p.place.y_m, 0.0, 1e-6);
  EXPECT_TRUE(path_on(line, {0.0, 0.0, 0.0, 0.0}).empty())
      << "a path to the next place is searched";
  EXPECT_NEAR(path_on(line, {5.0, 0.0, 0.0, 0.0}).back().place.x_m, 10.0, 1e-6);
}

TEST(WayBack, TheVehicleLeavesItsWayOnlyForAnObstacleThatRemains) {
  using Along = WayBackWatch::Along;
  WayBackWatch watch;
  const Pose2d here{5.0, 0.0, 0.0, 0.0};
  const auto ahead = [](double free_m) { return WayBackWatch::Ahead{free_m, false, 3.0, 10.0}; };
  const auto at = [](double s) { return Stamp(from_seconds(s)); };
  EXPECT_EQ(watch.on(ahead(20.0), here, at(0.0)), Along::kFree);
  EXPECT_EQ(watch.on(ahead(2.0), here, at(1.0)), Along::kWaits);
  EXPECT_EQ(watch.on(ahead(4.0), here, at(4.0)), Along::kFree) << "it was a wrong one";
  EXPECT_EQ(watch.on(ahead(2.0), here, at(5.0)), Along::kWaits);
  EXPECT_EQ(watch.on(ahead(2.0), here, at(9.5)), Along::kNo);
  EXPECT_FALSE(watch.keeps());
  EXPECT_EQ(watch.on(ahead(20.0), here, at(10.0)), Along::kNo) << "it has not moved yet";
  const Pose2d moved{6.0, 0.0, 0.0, 0.0};
  EXPECT_EQ(watch.on(ahead(9.0), moved, at(11.0)), Along::kNo);
  EXPECT_EQ(watch.on(ahead(11.0), moved, at(12.0)), Along::kFree);
  EXPECT_TRUE(watch.keeps());
  watch.leave(moved);
  EXPECT_EQ(watch.on(ahead(20.0), moved, at(12.2)), Along::kNo);
  EXPECT_EQ(watch.on({1.0, true, 3.0, 10.0}, moved, at(12.4)), Along::kFree) << "the end is free";
}

}  // namespace
}  // namespace rcs::bg

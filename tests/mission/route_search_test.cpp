#include "modules/mission/route_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <queue>
#include <random>

#include "tests/terrain/map_scene.h"

namespace rcs::mission {
namespace {

// 600 m a side about the origin, cells of 2 m, NaN unknown.
ElevationMap ground(const std::function<double(double, double)>& z) {
  Raster raster;
  raster.level.cell_m = 2.0;
  raster.first = {-150, -150};
  raster.width = raster.height = 300;
  raster.sigma_m = {0.1F};
  for (int j = 0; j < raster.height; ++j) {
    for (int i = 0; i < raster.width; ++i) {
      const Vec2 p = raster.level.centre({raster.first.i + i, raster.first.j + j});
      raster.z_m.push_back(static_cast<float>(z(p.x(), p.y())));
    }
  }
  Result<ElevationMap> map = ElevationMap::from_rasters(test::frame(), {raster});
  EXPECT_TRUE(map) << map.error().message;
  return std::move(*map);
}

const Area kArea{Vec2(-290.0, -290.0), Vec2(290.0, 290.0)};

/// Largest cost and mean poverty of the ground below a route.
std::pair<double, double> below(const RouteMap& map, const RouteLine& line) {
  double worst = 0.0;
  double poverty = 0.0;
  double sum_m = 0.0;
  for (std::size_t k = 1; k < line.size(); ++k) {
    const double length = (line[k] - line[k - 1]).norm();
    const int n = static_cast<int>(length) + 1;
    for (int s = 0; s < n; ++s) {
      const Cell c = map.cell_at(line[k - 1] + (s + 0.5) / n * (line[k] - line[k - 1]));
      worst = std::max<double>(worst, map.cost(c));
      poverty += map.poverty(c) * length / n;
    }
    sum_m += length;
  }
  return {worst, poverty / sum_m};
}

/// Length of a route over impassable cells.
double blocked_m(const RouteMap& map, const RouteLine& line) {
  constexpr double kEach_m = 0.05;
  double sum_m = 0.0;
  for (std::size_t k = 1; k < line.size(); ++k) {
    const Vec2 d = line[k] - line[k - 1];
    for (double s = 0.0; s < d.norm(); s += kEach_m) {
      sum_m += std::isinf(map.cost(map.cell_at(line[k - 1] + s * d.normalized()))) ? kEach_m : 0.0;
    }
  }
  return sum_m;
}

TEST(RouteSearch, OverOpenGroundTheRouteIsStraight) {
  const RouteMap map(ground([](double, double) { return 0.0; }), kArea, {});
  RouteSearch search;
  const RouteLine line = search.find(map, {-200.0, -150.0}, {200.0, 180.0}, 0.0);
  ASSERT_EQ(line.size(), 2U);
  EXPECT_EQ(line.front(), Vec2(-200.0, -150.0));
  EXPECT_EQ(line.back(), Vec2(200.0, 180.0));
}

TEST(RouteSearch, ARouteLeadsAroundABankAndThroughItsGap) {
  // A bank of 3 m along x = 0, open from y = 200 on.
  const auto bank = [](double x, double y) { return y < 200.0 && std::abs(x) < 4.0 ? 3.0 : 0.0; };
  const RouteMap map(ground(bank), kArea, {});
  RouteSearch search;
  const RouteLine line = search.find(map, {-100.0, 0.0}, {100.0, 0.0}, 0.0);
  ASSERT_GT(line.size(), 2U);
  EXPECT_FALSE(std::isinf(below(map, line).first));
  EXPECT_GT(length_m(line), 2.0 * std::hypot(100.0, 195.0));
  EXPECT_LT(length_m(line), 1.1 * 2.0 * std::hypot(100.0, 205.0));
}

TEST(RouteSearch, WithoutAGapThereIsNoRoute) {
  const auto bank = [](double x, double) { return std::abs(x) < 4.0 ? 3.0 : 0.0; };
  const RouteMap map(ground(bank), kArea, {});
  EXPECT_TRUE(RouteSearch().find(map, {-100.0, 0.0}, {100.0, 0.0}, 0.0).empty());
  EXPECT_TRUE(RouteSearch().find(map, {-100.0, 0.0}, {1000.0, 0.0}, 0.0).empty()) << "outside";
}

TEST(RouteSearch, TheWeightOfLocalizabilityLeadsOverTheHills) {
  // A plane in the south, and hills in the north.
  const auto half = [](double x, double y) {
    return y < 60.0 ? 0.0 : 2.0 * std::sin(0.1 * x) * std::cos(0.08 * y);
  };
  const RouteMap map(ground(half), kArea, {});
  RouteSearch search;
  const RouteLine shorter = search.find(map, {-250.0, 0.0}, {250.0, 0.0}, 0.0);
  const RouteLine safer = search.find(map, {-250.0, 0.0}, {250.0, 0.0}, 3.0);
  EXPECT_EQ(shorter.size(), 2U);
  EXPECT_GT(below(map, shorter).second, 0.9);
  EXPECT_LT(below(map, safer).second, 0.5);
  EXPECT_GT(distance_m(safer, shorter), 50.0);
}

TEST(RouteSearch, ABlockedPlaceIsAvoided) {
  RouteMap map(ground([](double, double) { return 0.0; }), kArea, {});
  map.block({0.0, 0.0}, 30.0);
  const RouteLine line = RouteSearch().find(map, {-100.0, 0.0}, {100.0, 0.0}, 0.0);
  ASSERT_GT(line.size(), 2U);
  EXPECT_FALSE(std::isinf(below(map, line).first));
  EXPECT_LT(length_m(line), 230.0);
}

// Two cells that touch at a corner: the vehicle does not fit between them.
TEST(RouteSearch, NoRouteSlipsBetweenImpassableCellsThatTouchAtACorner) {
  RouteMap map(Area{Vec2(-100.0, -100.0), Vec2(100.0, 100.0)}, {});
  for (int k = 0; k < map.width(); ++k) map.block(map.centre({k, k}), 0.5);
  const Vec2 from = map.centre({5, 30});
  const Vec2 to = map.centre({30, 5});
  RouteSearch search;
  EXPECT_TRUE(search.find(map, from, to, 0.0).empty());
  map.unblock();
  EXPECT_EQ(search.find(map, from, to, 0.0).size(), 2U) << "nothing remains of the blocks";
}

// A gap of one cell in a diagonal wall: a shortened line keeps to it.
TEST(RouteSearch, AStraightLineDoesNotCutTheCornersOfImpassableCells) {
  RouteMap map(Area{Vec2(-100.0, -100.0), Vec2(100.0, 100.0)}, {});
  for (int k = 0; k < map.width(); ++k) {
    if (k != 20) map.block(map.centre({k, k}), 0.5);
  }
  const RouteLine line = RouteSearch().find(map, map.centre({5, 30}), map.centre({30, 5}), 0.0);
  ASSERT_FALSE(line.empty());
  EXPECT_EQ(blocked_m(map, line), 0.0);
  const Vec2 gap = map.centre({20, 20});
  EXPECT_LT(distance_m({gap, gap}, line), 2.5);
}

// Against Dijkstra over the same cells with eight neighbours: the route is no more expensive.
TEST(RouteSearch, OverRandomGroundNoRouteIsMoreExpensiveThanThatOfDijkstra) {
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> u(-80.0, 80.0);
  int found = 0;
  for (int trial = 0; trial < 30; ++trial) {
    RouteMap map(Area{Vec2(-100.0, -100.0), Vec2(100.0, 100.0)}, {});
    for (int k = 0; k < 25; ++k) map.block({u(rng), u(rng)}, 12.0);
    const Vec2 from(-97.0, -97.0);
    const Vec2 to(92.0, 92.0);
    const RouteLine line = RouteSearch().find(map, from, to, 0.0);
    std::vector<double> cost(static_cast<std::size_t>(map.width() * map.height()), 1e18);
    const auto index = [&](Cell c) { return static_cast<std::size_t>(c.j * map.width() + c.i); };
    std::priority_queue<std::pair<double, int>> open;
    const Cell first = map.cell_at(from);
    cost[index(first)] = 0.0;
    open.emplace(0.0, static_cast<int>(index(first)));
    while (!open.empty()) {
      const auto [minus, at] = open.top();
      open.pop();
      const Cell c = {at % map.width(), at / map.width()};
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) {
          const Cell n = {c.i + i, c.j + j};
          if (!map.contains(n) || std::isinf(map.cost(n))) continue;
          if (std::isinf(map.cost({n.i, c.j})) || std::isinf(map.cost({c.i, n.j}))) continue;
          const double way = -minus + map.cell_m() * std::hypot(i, j);
          if (way >= cost[index(n)]) continue;
          cost[index(n)] = way;
          open.emplace(-way, static_cast<int>(index(n)));
        }
      }
    }
    const double best = cost[index(map.cell_at(to))];
    EXPECT_EQ(line.empty(), best > 1e17) << trial;
    if (line.empty()) continue;
    ++found;
    EXPECT_LT(blocked_m(map, line), 1.5) << trial << ": at most the corner of a cell at an end";
    EXPECT_LT(length_m(line), best + 0.1) << trial;
  }
  EXPECT_GT(found, 20);
}

}  // namespace
}  // namespace rcs::mission

#include "modules/bg/remembered_ground.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/bg/fields.h"

namespace rcs::bg {
namespace {

using test::level_field;

constexpr double kBody_m = 1.35;

// Terrain of `side` cells around a place, as WM publishes it while the vehicle drives.
void look(RememberedGround* remembered, const Pose2d& vehicle,
          const std::function<bool(double x_m, double y_m)>& blocked) {
  vj::Terrain terrain = level_field(128, [](double, double) { return false; });
  terrain.first.i += static_cast<int>(std::floor(vehicle.x_m / terrain.cell_m));
  terrain.first.j += static_cast<int>(std::floor(vehicle.y_m / terrain.cell_m));
  for (int j = 0; j < terrain.height; ++j) {
    for (int i = 0; i < terrain.width; ++i) {
      const Cell c{terrain.first.i + i, terrain.first.j + j};
      terrain.ground[terrain.index(c)].obstacle =
          blocked((c.i + 0.5) * terrain.cell_m, (c.j + 0.5) * terrain.cell_m);
    }
  }
  ObstacleDistance obstacles;
  obstacles.compute(terrain, {});
  remembered->note(vehicle, terrain, obstacles, {}, kBody_m);
}

FarCost cost_to(const Goal& goal, const RememberedGround& remembered) {
  FarCost out;
  out.compute(remembered, goal);
  return out;
}

TEST(FarCost, UnseenGroundCostsTheStraightDistance) {
  RememberedGround remembered;
  EXPECT_NEAR(FarCost().at(30.0, 40.0), 75.0, 1e-9) << "before the first computation";
  const FarCost cost = cost_to({10.0, -5.0, 2.0}, remembered);
  for (const double heading : {0.0, 0.4, 0.8, 1.2, 2.0, 3.0, 4.0, 5.5}) {
    const double x_m = 10.0 + 70.0 * std::cos(heading);
    const double y_m = -5.0 + 70.0 * std::sin(heading);
    EXPECT_NEAR(cost.at(x_m, y_m), 1.5 * 68.0, 0.05 * 1.5 * 68.0) << heading;
  }
}

TEST(FarCost, AGoalOutsideOfTheWindowIsApproached) {
  RememberedGround remembered;
  const FarCost cost = cost_to({500.0, 100.0, 2.0}, remembered);
  EXPECT_NEAR(cost.at(0.0, 0.0), 1.5 * std::hypot(500.0, 100.0), 8.0);
  EXPECT_LT(cost.at(50.0, 10.0), cost.at(0.0, 0.0));
  EXPECT_NEAR(cost.at(-300.0, 0.0), 1.5 * std::hypot(800.0, 100.0), 1e-6);
}

// However far it is: the cost of a long way is no barrier.
TEST(FarCost, AGoalOfManyKilometresIsReachable) {
  RememberedGround remembered;
  const auto cost = cost_to({8000.0, -3000.0, 2.0}, remembered);
  EXPECT_TRUE(cost.reachable_from(0.0, 0.0));
  look(&remembered, {}, [](double x, double y) {
    return std::abs(std::max(std::abs(x), std::abs(y)) - 10.0) < 0.3;
  });
  EXPECT_FALSE(cost_to({8000.0, -3000.0, 2.0}, remembered).reachable_from(0.0, 0.0));
  EXPECT_TRUE(cost_to({8000.0, -3000.0, 2.0}, remembered).reachable_from(20.0, 0.0));
}

TEST(FarCost, ForbiddenCellsAreDrivenAroundAndNotRemembered) {
  RememberedGround remembered;
  look(&remembered, {}, [](double, double) { return false; });
  // A strip of 60 m across the way, partly beyond the terrain.
  constexpr int kCells = RememberedGround::kCells;
  std::vector<std::uint8_t> forbidden(static_cast<std::size_t>(kCells) * kCells, 0);
  const Cell origin = remembered.per_m().origin();
  for (int j = 0; j < kCells; ++j) {
    for (int i = 0; i < kCells; ++i) {
      const double x_m = (origin.i + i + 0.5) * RememberedGround::kCell_m;
      const double y_m = (origin.j + j + 0.5) * RememberedGround::kCell_m;
      if (std::abs(x_m - 15.0) < 1.0 && std::abs(y_m) < 30.0) {
        forbidden[static_cast<std::size_t>(j * kCells + i)] = 1;
      }
    }
  }
  const Goal goal{30.0, 0.0, 2.0};
  const double straight = cost_to(goal, remembered).at(0.0, 0.0);
  FarCost cost;
  cost.compute(remembered, goal, &forbidden);
  EXPECT_GT(cost.at(0.0, 0.0), straight + 25.0);
  EXPECT_TRUE(cost.reachable_from(0.0, 0.0));
  EXPECT_NEAR(cost_to(goal, remembered).at(0.0, 0.0), straight, 1e-6);
}

// A wall of 60 m that the vehicle has driven along: at one end of it the other end is not in the
// terrain any more, and its way around is known nevertheless.
TEST(RememberedGround, AWallIsRememberedWhenItHasLeftTheTerrain) {
  const auto wall = [](double x, double y) { return std::abs(x) < 0.3 && std::abs(y) < 30.0; };
  RememberedGround remembered;
  for (double y_m = -30.0; y_m <= 30.0; y_m += 5.0) look(&remembered, {-6.0, y_m, 1.57, 0.0}, wall);
  look(&remembered, {-6.0, 60.0, 1.57, 0.0}, wall);
  const FarCost cost = cost_to({20.0, 0.0, 2.0}, remembered);
  const Pose2d before{-6.0, 0.0, 0.0, 0.0};
  EXPECT_TRUE(cost.reachable_from(before.x_m, before.y_m));
  const double around_m = std::hypot(6.0, 31.3) + std::hypot(20.0, 31.3);
  EXPECT_GT(cost.at(before.x_m, before.y_m), around_m);
  EXPECT_LT(cost.at(before.x_m, before.y_m), 1.6 * around_m);
}

// In a dead end the cost grows towards its closed end: the way leads out of it.
TEST(RememberedGround, TheWayOutOfADeadEndLeadsBack) {
  const auto walls = [](double x, double y) {
    return (std::abs(x) < 0.3 && std::abs(y) < 5.0) ||
           (x > -50.0 && x < 0.3 && std::abs(std::abs(y) - 5.0) < 0.3);
  };
  RememberedGround remembered;
  for (double x_m = -60.0; x_m <= -3.0; x_m += 5.0) look(&remembered, {x_m, 0.0, 0.0, 0.0}, walls);
  const FarCost cost = cost_to({40.0, 0.0, 2.0}, remembered);
  EXPECT_TRUE(cost.reachable_from(-4.0, 0.0));
  for (double x_m = -48.0; x_m < -4.0; x_m += 4.0) {
    EXPECT_GT(cost.at(x_m + 4.0, 0.0), cost.at(x_m, 0.0)) << x_m;
  }
}

TEST(RememberedGround, AnEnclosedGoalIsNotReachableUntilAGapIsSeen) {
  const auto pen = [](double x, double y) {
    return std::abs(std::max(std::abs(x), std::abs(y)) - 10.0) < 0.3;
  };
  RememberedGround remembered;
  const Goal goal{0.0, 0.0, 2.0};
  const Pose2d outside{-18.0, 0.0, 0.0, 0.0};
  EXPECT_TRUE(cost_to(goal, remembered).reachable_from(outside.x_m, outside.y_m))
      << "nothing was seen yet";
  look(&remembered, outside, pen);
  look(&remembered, {18.0, 0.0, 0.0, 0.0}, pen);
  EXPECT_FALSE(cost_to(goal, remembered).reachable_from(outside.x_m, outside.y_m));
  EXPECT_TRUE(cost_to(goal, remembered).reachable_from(-5.0, 0.0));
  const auto gate = [&pen](double x, double y) {
    return pen(x, y) && (x > 0.0 || std::abs(y) > 2.0);
  };
  look(&remembered, outside, gate);
  EXPECT_TRUE(cost_to(goal, remembered).reachable_from(outside.x_m, outside.y_m));
}

// What is found beside the way that the vehicle has come, or what seems to be there, does not
// enclose it.
TEST(RememberedGround, TheWayThatTheVehicleHasComeStaysOpen) {
  const auto pen = [](double x, double y) {
    return std::abs(std::max(std::abs(x), std::abs(y)) - 10.0) < 0.3;
  };
  const auto gate = [&pen](double x, double y) {
    return pen(x, y) && (x > 0.0 || std::abs(y) > 2.0);
  };
  const Goal goal{-20.0, 0.0, 2.0};
  RememberedGround drove;
  for (double x_m = -16.0; x_m <= 0.0; x_m += 1.5) look(&drove, {x_m, 0.0, 0.0, 0.0}, gate);
  const double open = cost_to(goal, drove).at(0.0, 0.0);
  look(&drove, {}, pen);
  EXPECT_TRUE(cost_to(goal, drove).reachable_from(0.0, 0.0));
  EXPECT_GT(cost_to(goal, drove).at(0.0, 0.0), open + 50.0) << "another way would be preferred";
  RememberedGround jumped;
  look(&jumped, {-16.0, 0.0, 0.0, 0.0}, gate);
  look(&jumped, {}, pen);
  EXPECT_FALSE(cost_to(goal, jumped).reachable_from(0.0, 0.0));
}

TEST(RememberedGround, AnotherFrameLocalForgetsAll) {
  RememberedGround remembered;
  look(&remembered, {}, [](double x, double y) {
    return std::abs(std::max(std::abs(x), std::abs(y)) - 10.0) < 0.3;
  });
  const Goal far{30.0, 0.0, 2.0};
  EXPECT_FALSE(cost_to(far, remembered).reachable_from(0.0, 0.0));
  remembered.clear();
  EXPECT_TRUE(cost_to(far, remembered).reachable_from(0.0, 0.0));
}

}  // namespace
}  // namespace rcs::bg

#include "modules/vj/traversal_cost.h"

#include <gtest/gtest.h>

#include <cmath>

#include "rcs/base/linear.h"

namespace rcs::vj {
namespace {

Ground level() {
  Ground g;
  g.known = true;
  return g;
}

TEST(TraversalCost, BeyondAnAlertLimitTheSpeedIsZero) {
  const SpeedParams p;
  const double limit = p.alert_limit_horizontal_m;
  EXPECT_EQ(protected_share(0.4 * limit, 1.0, p), 1.0);
  EXPECT_LT(protected_share(0.8 * limit, 1.0, p), 0.8);
  EXPECT_GT(protected_share(0.99 * limit, 1.0, p), 0.2);
  EXPECT_EQ(protected_share(1.01 * limit, 1.0, p), 0.0);
  EXPECT_EQ(protected_share(1.0, 1.01 * p.alert_limit_vertical_m, p), 0.0);
  EXPECT_EQ(protected_share(std::numeric_limits<double>::infinity(), 1.0, p), 0.0);
  EXPECT_EQ(protected_share(std::numeric_limits<double>::quiet_NaN(), 1.0, p), 0.0);
}

TEST(TraversalCost, EasyGroundCostsItsLength) {
  EXPECT_DOUBLE_EQ(cost_per_m(level(), 100.0, {}), 1.0);
  EXPECT_DOUBLE_EQ(speed_on(level(), 100.0, {}, {}).mps, SpeedParams{}.smooth_mps);
}

// Worse ground is never cheaper or faster.
TEST(TraversalCost, WorseGroundCostsMoreAndIsDrivenMoreSlowly) {
  const Weights w;
  const SpeedParams p;
  double last_cost = 0.0;
  double last_speed = 1e9;
  for (int k = 0; k <= 10; ++k) {
    Ground g = level();
    g.slope_rad = static_cast<float>(0.1 * k * w.max_slope_rad);
    g.roughness_m = static_cast<float>(0.1 * k * w.max_roughness_m);
    g.step_m = static_cast<float>(0.1 * k * w.max_step_m);
    const double cost = cost_per_m(g, 10.0 - k, w);
    const double speed = speed_on(g, 10.0 - k, w, p).mps;
    EXPECT_GE(cost, last_cost);
    EXPECT_LE(speed, last_speed);
    EXPECT_GT(speed, 0.0);
    last_cost = cost;
    last_speed = speed;
  }
}

TEST(TraversalCost, ASpeedHasItsCause) {
  const SpeedParams p;
  Ground g = level();
  g.slope_rad = 0.3F;
  EXPECT_EQ(speed_on(g, 10.0, {}, p).cause, SpeedCause::kGround);
  EXPECT_EQ(speed_on(g, 0.0, {}, p).cause, SpeedCause::kClearance);
  g.vegetation = true;
  EXPECT_EQ(speed_on(g, 10.0, {}, p).cause, SpeedCause::kVegetation);
  g.vegetation = g.known = false;
  EXPECT_EQ(speed_on(g, 10.0, {}, p).cause, SpeedCause::kUnknown);
}

TEST(TraversalCost, ObstaclesAndCliffsAreNotDriven) {
  Ground g = level();
  g.obstacle = true;
  EXPECT_FALSE(passable(g, {}));
  g = level();
  g.slope_rad = 0.7F;
  EXPECT_FALSE(passable(g, {}));
  EXPECT_TRUE(
      passable(Ground{}, {}));  // unknown: slowly, and observed before the vehicle reaches it
  EXPECT_GT(cost_per_m(Ground{}, 10.0, {}), 1.0);
}

TEST(TraversalCost, TheRollIsThatOfTheSlopeAcrossTheVehicle) {
  Ground g;
  g.known = true;
  g.rise_y = static_cast<float>(std::tan(radians(20.0)));
  EXPECT_NEAR(degrees(roll_on(g, 0.0)), 20.0, 1e-4);
  EXPECT_NEAR(degrees(roll_on(g, kPi)), -20.0, 1e-4);
  EXPECT_NEAR(roll_on(g, 0.5 * kPi), 0.0, 1e-6) << "straight up the slope";
  const Weights w;
  EXPECT_EQ(cost_of_roll(0.0, w), 0.0);
  EXPECT_DOUBLE_EQ(cost_of_roll(-w.max_roll_rad, w), w.roll);
  EXPECT_DOUBLE_EQ(cost_of_roll(0.5 * w.max_roll_rad, w), 0.25 * w.roll);
}

TEST(TraversalCost, ALargerPoseSigmaGivesALowerSpeed) {
  const SpeedParams p;
  EXPECT_DOUBLE_EQ(speed_share(0.0, p), 1.0);
  EXPECT_DOUBLE_EQ(speed_share(p.full_speed_sigma_m, p), 1.0);
  EXPECT_NEAR(speed_share(p.stop_sigma_m - 1e-9, p), p.min_speed_share, 1e-6);
  EXPECT_DOUBLE_EQ(speed_share(p.stop_sigma_m, p), 0.0);
  EXPECT_DOUBLE_EQ(speed_share(std::nan(""), p), 0.0);
}

TEST(TraversalCost, TurnsRespectTheLateralAccelerationLimit) {
  const SpeedParams p;
  const double v = speed_in_turn(0.18, p);
  EXPECT_NEAR(v * v * 0.18, p.lateral_mps2, 1e-9);
  EXPECT_DOUBLE_EQ(speed_in_turn(0.0, p), p.smooth_mps);
}

}  // namespace
}  // namespace rcs::vj

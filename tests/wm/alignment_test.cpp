// Levelling from the specific force at rest.
#include <gtest/gtest.h>

#include <cmath>

#include "modules/wm/alignment.h"

namespace rcs::wm {
namespace {

struct Levelled {
  Belief belief;
  double gravity;
};

Levelled level_at_rest(const Vec3& specific_force, double accel_turn_on) {
  WmParams params;
  params.ins.accel_turn_on = accel_turn_on;
  Leveler leveler;
  ImuSample imu;
  imu.interval = from_milliseconds(10.0);
  imu.delta_v = specific_force * seconds(imu.interval);
  for (Stamp t = from_utime(1'000'000);; t += imu.interval) {
    imu.stamp = t;
    const std::optional<Belief> belief = leveler.add(imu, params);
    if (belief) return {*belief, leveler.gravity()};
  }
}

constexpr double kPoorAccelerometer = 0.2;  // 20 mg [m/s^2]
constexpr double kGoodAccelerometer = 5e-3;

TEST(Leveler, AVerticalBiasIsNotAttributedToGravity) {
  const Levelled rest = level_at_rest(Vec3(0, 0, 9.80 + 0.25), kPoorAccelerometer);
  EXPECT_NEAR(rest.gravity, 9.80, 0.02);
  const double sigma = std::sqrt(rest.belief.P(kAccelBias + 2, kAccelBias + 2));
  EXPECT_LT(std::abs(rest.belief.x.accel_bias.z() - 0.25), 2.0 * sigma);
  EXPECT_LT(sigma, 0.03);
}

TEST(Leveler, AGoodAccelerometerMeasuresGravity) {
  const double at_the_equator = 9.780;
  const Levelled rest = level_at_rest(Vec3(0, 0, at_the_equator), kGoodAccelerometer);
  EXPECT_NEAR(rest.gravity, at_the_equator, 0.005);
}

// Otherwise the estimated vehicle would climb while at rest.
TEST(Leveler, BiasAndGravityAddUpToTheMeasurement) {
  for (const double turn_on : {kPoorAccelerometer, kGoodAccelerometer, 0.05}) {
    const Levelled rest = level_at_rest(Vec3(0, 0, 9.83), turn_on);
    EXPECT_NEAR(rest.gravity + rest.belief.x.accel_bias.z(), 9.83, 0.01) << turn_on;
  }
}

}  // namespace
}  // namespace rcs::wm

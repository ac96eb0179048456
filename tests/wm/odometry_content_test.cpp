// Samples of the wheels that repeat the one before.

#include "lcmtypes/odometry_content.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace rcs {
namespace {

/// At 20 Hz.
odometry_t sample(int k, double speed_mps, double yaw_rate_radps) {
  odometry_t m{};
  m.utime = std::int64_t{50'000} * k;
  m.interval_us = 50'000;
  m.speed_mps = speed_mps;
  m.yaw_rate_radps = yaw_rate_radps;
  return m;
}

/// The samples of 3 s with noise, all of which are measurements.
OdometryContent after_noise(int* k, double yaw_rate_radps) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.05);
  OdometryContent content;
  for (*k = 0; *k < 60; ++*k) {
    EXPECT_TRUE(content.add(sample(*k, 8.0 + noise(random), yaw_rate_radps)));
  }
  return content;
}

TEST(OdometryContent, AStuckSensorIsRejectedAndReturns) {
  for (const double yaw_rate_radps : {0.02, std::numeric_limits<double>::quiet_NaN()}) {
    int k = 0;
    OdometryContent content = after_noise(&k, yaw_rate_radps);
    int accepted = 0;
    for (int i = 0; i < 100; ++i) accepted += content.add(sample(++k, 7.9, yaw_rate_radps)) ? 1 : 0;
    EXPECT_LE(accepted, 7);
    EXPECT_TRUE(content.add(sample(++k, 7.8, yaw_rate_radps)));
  }
}

TEST(OdometryContent, AVehicleAtRestRepeatsItsValues) {
  int k = 0;
  OdometryContent content = after_noise(&k, 0.02);
  for (int i = 0; i < 500; ++i) EXPECT_TRUE(content.add(sample(++k, 0.0, 0.0)));
}

TEST(OdometryContent, ACoarseEncoderMayRepeatItsValues) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.02);
  OdometryContent content;
  for (int k = 0; k < 2000; ++k) {
    const double speed_mps = 0.1 * std::round(10.0 * (8.0 + noise(random)));
    EXPECT_TRUE(content.add(sample(k, speed_mps, 0.0))) << k;
  }
}

}  // namespace
}  // namespace rcs

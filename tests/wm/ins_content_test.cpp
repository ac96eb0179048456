// Increments that no working INS measures.

#include "lcmtypes/ins_content.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

namespace rcs {
namespace {

ins_t noisy(std::mt19937* random, int k) {
  std::normal_distribution<double> noise(0.0, 1e-4);
  ins_t m{};
  m.utime = std::int64_t{10'000} * k;
  m.interval_us = 10'000;
  for (int i = 0; i < 3; ++i) {
    m.delta_angle_rad[i] = noise(*random);
    m.delta_v_mps[i] = noise(*random) + (i == 2 ? 0.0981 : 0.0);
  }
  return m;
}

TEST(InsContent, NoiseIsAMeasurement) {
  std::mt19937 random(1);
  InsContent content;
  for (int k = 0; k < 1000; ++k) EXPECT_EQ(content.add(noisy(&random, k)), InsFault::kNone);
}

TEST(InsContent, AStuckSensorIsRejectedAndReturns) {
  std::mt19937 random(1);
  InsContent content;
  int k = 0;
  for (; k < 200; ++k) EXPECT_EQ(content.add(noisy(&random, k)), InsFault::kNone);
  ins_t stuck = noisy(&random, k);
  int accepted = 0;
  for (int i = 0; i < 100; ++i) {
    stuck.utime = std::int64_t{10'000} * ++k;
    const InsFault fault = content.add(stuck);
    accepted += fault == InsFault::kNone ? 1 : 0;
    if (fault != InsFault::kNone) {
      EXPECT_EQ(fault, InsFault::kFrozen);
      if (i < 30) {
        EXPECT_EQ(content.wrong_since(), std::int64_t{10'000} * 202) << "the first repetition";
      }
    }
  }
  EXPECT_LE(accepted, 8);
  EXPECT_EQ(content.add(noisy(&random, ++k)), InsFault::kNone);
}

TEST(InsContent, ASensorWithoutNoiseMayRepeatItsValues) {
  std::mt19937 random(1);
  InsContent content;
  ins_t m = noisy(&random, 0);
  for (int k = 0; k < 500; ++k) {
    m.utime = std::int64_t{10'000} * k;
    EXPECT_EQ(content.add(m), InsFault::kNone) << k;
  }
}

TEST(InsContent, NoSpecificForceIsNoMeasurement) {
  std::mt19937 random(1);
  InsContent content;
  ins_t zero = noisy(&random, 1);
  for (double& v : zero.delta_v_mps) v = 0.0;
  EXPECT_EQ(content.add(zero), InsFault::kNoForce);
  // In the air for a moment.
  int accepted = 0;
  for (int k = 2; k < 20; ++k) {
    ins_t falling = noisy(&random, k);
    falling.delta_v_mps[2] -= 0.0981;
    accepted += content.add(falling) == InsFault::kNone ? 1 : 0;
  }
  EXPECT_GT(accepted, 5);
  EXPECT_LT(accepted, 9);
}

TEST(InsContent, RoughGroundIsAMeasurement) {
  // Nearly weightless for 0.3 s behind a bump, then twice the weight, while the vehicle brakes.
  std::mt19937 random(1);
  InsContent content;
  for (int k = 0; k < 300; ++k) {
    ins_t m = noisy(&random, k);
    const bool light = k % 60 < 30;
    m.delta_v_mps[0] -= 0.02;
    m.delta_v_mps[2] = light ? 0.015 : 0.2;
    EXPECT_EQ(content.add(m), InsFault::kNone) << k;
  }
}

TEST(InsContent, AForceThatDoesNotPointUpwardsIsNoMeasurement) {
  for (const bool inverted : {false, true}) {
    std::mt19937 random(1);
    InsContent content;
    int k = 0;
    for (; k < 100; ++k) EXPECT_EQ(content.add(noisy(&random, k)), InsFault::kNone);
    int accepted = 0;
    for (; k < 200; ++k) {
      ins_t wrong = noisy(&random, k);
      if (inverted) wrong.delta_v_mps[2] *= -1.0;
      if (!inverted) std::swap(wrong.delta_v_mps[0], wrong.delta_v_mps[2]);
      const InsFault fault = content.add(wrong);
      accepted += fault == InsFault::kNone ? 1 : 0;
      if (fault != InsFault::kNone) {
        EXPECT_EQ(fault, InsFault::kNotUpward);
      }
      if (fault != InsFault::kNone && k < 120) {
        EXPECT_EQ(content.wrong_since(), std::int64_t{10'000} * 100) << "the first wrong one";
      }
    }
    EXPECT_LE(accepted, 17);
    int until_back = 0;
    while (content.add(noisy(&random, ++k)) != InsFault::kNone) ++until_back;
    EXPECT_GE(until_back, 95) << "a second";
    EXPECT_LE(until_back, 120);
  }
}

TEST(InsContent, AWrongSampleWithAWrongStampDoubtsNoOther) {
  constexpr std::int64_t kNow = 2'000'000;
  constexpr std::int64_t kFarthest = std::numeric_limits<std::int64_t>::max();
  for (const std::int64_t stamp : {-kFarthest, std::int64_t{0}, kNow - 500'000, kFarthest}) {
    std::mt19937 random(1);
    InsContent content;
    for (int k = 1; k < 200; ++k) EXPECT_EQ(content.add(noisy(&random, k)), InsFault::kNone);
    for (int again = 0; again < 3; ++again) {  // nothing is measured
      ins_t wrong{};
      wrong.utime = stamp;
      wrong.interval_us = 10'000;
      EXPECT_EQ(content.add(wrong), InsFault::kNoForce);
      EXPECT_EQ(content.wrong_since(), stamp);
    }
  }
}

TEST(InsContent, ASteepRoughSlopeIsAMeasurement) {
  std::mt19937 random(1);
  std::normal_distribution<double> bumps(0.0, 3.0);  // [m/s^2]
  InsContent content;
  for (int k = 0; k < 2000; ++k) {
    ins_t m = noisy(&random, k);
    m.delta_v_mps[0] = 0.01 * (-9.81 * 0.64 + bumps(random));  // 40 degrees
    m.delta_v_mps[2] = 0.01 * (9.81 * 0.77 + bumps(random));
    EXPECT_EQ(content.add(m), InsFault::kNone) << k;
  }
}

/// Light over a crest, braking in a bend.
TEST(InsContent, ACrestIsAMeasurement) {
  std::mt19937 random(1);
  InsContent content;
  for (int k = 0; k < 400; ++k) {
    ins_t m = noisy(&random, k);
    if (k >= 200 && k < 250) {
      m.delta_v_mps[0] += 0.01 * -2.5;
      m.delta_v_mps[1] += 0.01 * 4.0;
      m.delta_v_mps[2] += 0.01 * (1.5 - 9.81);
    }
    EXPECT_EQ(content.add(m), InsFault::kNone) << k;
  }
}

/// A turn that exceeds the range of the gyro for half a second, with some noise.
int rejected_in_a_turn(double range_radps, double resolution_radps) {
  constexpr double kPeriod_s = 0.01;
  std::mt19937 random(1);
  InsContent content;
  int rejected = 0;
  for (int k = 0; k < 400; ++k) {
    ins_t m = noisy(&random, k);
    const double turn_radps = k < 200 ? 0.0 : 0.6 * std::sin(0.5 * (k - 200) * kPeriod_s * 3.14);
    double rate_radps = turn_radps + m.delta_angle_rad[2] / kPeriod_s;
    rate_radps = std::clamp(rate_radps, -range_radps, range_radps);
    if (resolution_radps > 0.0) {
      rate_radps = resolution_radps * std::round(rate_radps / resolution_radps);
    }
    m.delta_angle_rad[2] = rate_radps * kPeriod_s;
    const InsFault fault = content.add(m);
    if (fault == InsFault::kNone) continue;
    EXPECT_EQ(fault, InsFault::kSaturated) << k;
    ++rejected;
  }
  return rejected;
}

TEST(InsContent, ASaturatedAxisIsRejected) {
  EXPECT_EQ(rejected_in_a_turn(1.0, 0.0), 0);
  // Of the 0.93 s above 0.45 rad/s; the first samples of the series are accepted.
  EXPECT_GT(rejected_in_a_turn(0.45, 0.0), 75);
}

TEST(InsContent, ACoarseConverterIsNotSaturated) {
  constexpr double kSixteenBit_radps = 1.5e-4;  // of +-280 deg/s
  EXPECT_EQ(rejected_in_a_turn(1.0, kSixteenBit_radps), 0);
  EXPECT_EQ(rejected_in_a_turn(1.0, 10.0 * kSixteenBit_radps), 0);
}

}  // namespace
}  // namespace rcs

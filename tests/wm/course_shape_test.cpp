// A wrong gyro and drifting fixes are distinguished by the shape of the difference of their
// courses.
#include "modules/wm/fault_detection/course_shape.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "rcs/base/pose.h"

namespace rcs::wm {
namespace {

constexpr double kSpeed_mps = 8.0;
constexpr double kBegin_s = 25.0;  // of the faults

struct Fault {
  std::function<double(double t_s, double radps)> gyro = [](double, double radps) { return radps; };
  Vec2 drift_mps = Vec2::Zero();
  double turned_rad = 0.0;  ///< of the fixes
  double wheels = 1.0;
};

/// 35 s at 8 m/s, bends to both sides.
/// @return the result 10 s after the begin of the fault
double drive(const Fault& fault, unsigned seed = 1, double bend_radps = 0.15) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, 0.1);
  CourseShape shape;
  double heading_rad = 3.0;  // passes through pi
  for (int k = 0; k <= 3500; ++k) {
    const double t = 0.01 * k;
    const double radps = bend_radps * std::cos(0.3 * t);
    heading_rad += 0.01 * radps;
    const bool faulty = t > kBegin_s;
    shape.turn(Stamp() + from_seconds(t), faulty ? fault.gyro(t - kBegin_s, radps) : radps);
    if (k % 20 != 0) continue;
    Vec2 v = kSpeed_mps * Vec2(std::cos(heading_rad), std::sin(heading_rad));
    if (faulty) v = Eigen::Rotation2Dd(fault.turned_rad) * v + fault.drift_mps;
    v += Vec2(noise(random), noise(random));
    shape.add(Stamp() + from_seconds(t), v, fault.wheels * kSpeed_mps);
  }
  const std::optional<double> result = shape.gyro_against_fixes();
  EXPECT_TRUE(result.has_value());
  return result.value_or(0.0);
}

TEST(CourseShape, FixesThatAreTurnedAreNoWrongGyro) {
  for (const double turned_deg : {-20.0, -3.0, 3.0, 20.0}) {
    Fault fault;
    fault.turned_rad = radians(turned_deg);
    EXPECT_LT(drive(fault), 5.0) << turned_deg;
  }
}

TEST(CourseShape, AWrongGyroTurnsTheCourseSteadily) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Fault bias;
    bias.gyro = [](double, double radps) { return radps + 0.012; };
    EXPECT_GT(drive(bias, seed), 25.0) << seed;
    Fault ended = bias;
    ended.gyro = [](double t, double radps) { return radps + (t < 5.0 ? 0.03 : 0.0); };
    EXPECT_GT(drive(ended, seed), 25.0) << seed;
    Fault scale;
    scale.gyro = [](double, double radps) { return 1.15 * radps; };
    EXPECT_GT(drive(scale, seed, 0.3), 25.0) << seed;
  }
}

TEST(CourseShape, ADriftOfTheFixesBeginsAtOnceAndShowsInTheSpeed) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    for (const Vec2& drift : {Vec2(0.0, 0.6), Vec2(0.5, 0.0), Vec2(-0.4, 0.4)}) {
      Fault fault;
      fault.drift_mps = drift;
      EXPECT_LT(drive(fault, seed), -10.0) << seed << ": " << drift.transpose();
    }
  }
}

TEST(CourseShape, NoFaultAndWheelsOfAnotherSizeAreNotAWrongGyro) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    EXPECT_LT(std::abs(drive({}, seed)), 20.0) << seed;
    Fault wheels;
    wheels.wheels = 1.03;
    EXPECT_LT(std::abs(drive(wheels, seed)), 20.0) << seed;
  }
}

TEST(CourseShape, TellsNothingAfterAGapNorAtAWalk) {
  CourseShape shape;
  const auto fill = [&shape](double from_s, double speed_mps) {
    for (int k = 0; k < 60; ++k) {
      const Stamp t = Stamp() + from_seconds(from_s + 0.2 * k);
      for (int j = 0; j < 4; ++j) shape.turn(t + from_seconds(0.05 * j), 0.0);
      shape.add(t, Vec2(speed_mps, 0.0), speed_mps);
    }
  };
  fill(0.0, 5.0);
  EXPECT_TRUE(shape.gyro_against_fixes().has_value());
  fill(20.0, 1.0);
  EXPECT_FALSE(shape.gyro_against_fixes().has_value()) << "slow";
  fill(40.0, 5.0);
  EXPECT_TRUE(shape.gyro_against_fixes().has_value());
  shape.add(Stamp() + from_seconds(55.0), Vec2(5.0, 0.0), 5.0);
  EXPECT_FALSE(shape.gyro_against_fixes().has_value()) << "after a gap";
  fill(30.0, 5.0);
  ASSERT_TRUE(shape.gyro_against_fixes().has_value()) << "after a step back of the clocks";
  EXPECT_LT(std::abs(*shape.gyro_against_fixes()), 1.0);
}

TEST(CourseShape, OneFixASecondIsTooFew) {
  CourseShape shape;
  for (int k = 0; k < 1000; ++k) {
    const Stamp t = Stamp() + from_seconds(0.1 * k);
    shape.turn(t, 0.0);
    if (k % 10 == 0) shape.add(t, Vec2(5.0, 0.0), 5.0);
  }
  EXPECT_FALSE(shape.gyro_against_fixes().has_value());
}

}  // namespace
}  // namespace rcs::wm

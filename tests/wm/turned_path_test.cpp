// A wrong heading and drifting fixes are distinguished by the shape of the path.
#include "modules/wm/fault_detection/turned_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace rcs::wm {
namespace {

/// At 8 m/s: straight, 8 s on a circle of 30 m to the left, then to the right.
Vec3 bend(double t_s) {
  constexpr double kSpeed = 8.0, kRadius = 30.0, kStraight_s = 5.0, kLeft_s = 8.0;
  if (t_s < kStraight_s) return {kSpeed * t_s, 0.0, 0.0};
  const auto left = [](double t) -> Vec3 {
    const double angle = kSpeed * t / kRadius;
    return {kSpeed * kStraight_s + kRadius * std::sin(angle), kRadius * (1.0 - std::cos(angle)),
            0.0};
  };
  const double in_bend_s = t_s - kStraight_s;
  if (in_bend_s < kLeft_s) return left(in_bend_s);
  const double turned = kSpeed * kLeft_s / kRadius;
  const double back = kSpeed * (in_bend_s - kLeft_s) / kRadius;
  const Vec3 centre = left(kLeft_s) + kRadius * Vec3(std::sin(turned), -std::cos(turned), 0.0);
  return centre + kRadius * Vec3(-std::sin(turned - back), std::cos(turned - back), 0.0);
}
Vec3 circle(double t_s) {
  return 30.0 * Vec3(std::sin(8.0 / 30.0 * t_s), std::cos(8.0 / 30.0 * t_s), 0.0);
}
Vec3 straight(double t_s) { return {8.0 * t_s, 0.0, 0.0}; }

using Path = std::function<Vec3(double)>;

constexpr double kNoVelocities = -1.0;

TurnedPath drive(const Path& own, const Path& fix, double length_s = 20.0,
                 double sigma_mps = kNoVelocities) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.3);
  std::normal_distribution<double> unit(0.0, 1.0);
  TurnedPath path;
  for (int k = 0; k * 0.2 < length_s; ++k) {
    const double t = 0.2 * k;
    const Vec3 error(noise(random), noise(random), 0.0);
    const auto velocity = [](const Path& of, double s) -> Vec3 {
      return (of(s + 0.01) - of(s - 0.01)) / 0.02;
    };
    const Vec3 v = velocity(own, t);
    const double radps =
        v.cross(velocity(own, t + 0.01) - velocity(own, t - 0.01)).z() / 0.02 / v.squaredNorm();
    TurnedPath::Fix z{fix(t) + error, 0.3};
    if (sigma_mps != kNoVelocities) {
      z.v_mps = velocity(fix, t) + sigma_mps * Vec3(unit(random), unit(random), 0.0);
      z.sigma_mps = sigma_mps;
    }
    path.add(from_utime(1'000'000) + from_seconds(t), {own(t), v, radps}, z);
  }
  return path;
}

Path turned(const Path& path, double yaw_rad) {
  return [path, yaw_rad](double t) -> Vec3 {
    return Quat(Eigen::AngleAxisd(yaw_rad, Vec3::UnitZ())) * path(t) + Vec3(3.0, -2.0, 0.0);
  };
}

TEST(TurnedPath, AWrongHeadingIsFoundInABend) {
  for (const double yaw_deg : {-20.0, -7.0, 7.0, 12.0, 90.0}) {
    const auto found = drive(turned(bend, radians(-yaw_deg)), bend).found();
    ASSERT_TRUE(found) << yaw_deg;
    EXPECT_NEAR(yaw_of(found->T_new_old.q), radians(yaw_deg), 3.0 * found->sigma_yaw_rad);
    const Vec3 end = found->T_new_old * turned(bend, radians(-yaw_deg))(20.0);
    EXPECT_LT((end - bend(20.0)).norm(), 1.5) << yaw_deg;
  }
}

TEST(TurnedPath, TheVelocitiesOfTheFixesTellSmallAngles) {
  for (const double yaw_deg : {-4.0, -2.5, 2.5, 4.0}) {
    const Path own = turned(bend, radians(-yaw_deg));
    EXPECT_FALSE(drive(own, bend).found()) << yaw_deg;
    const auto found = drive(own, bend, 20.0, 0.1).found();
    ASSERT_TRUE(found) << yaw_deg;
    EXPECT_NEAR(yaw_of(found->T_new_old.q), radians(yaw_deg), radians(0.5));
    EXPECT_LT((found->T_new_old * own(20.0) - bend(20.0)).norm(), 1.0) << yaw_deg;
  }
  EXPECT_FALSE(drive(turned(straight, radians(2.5)), straight, 20.0, 0.1).found());
}

TEST(TurnedPath, FixesThatDriftDoNotTurnThePath) {
  for (const double mps : {0.2, 1.0, 3.0}) {
    const auto drifting = [mps](double t) -> Vec3 {
      return bend(t) + Vec3(0.6, 0.8, 0.0) * mps * t;
    };
    EXPECT_FALSE(drive(bend, drifting).found()) << mps;
    EXPECT_FALSE(drive(bend, drifting, 20.0, 0.1).found()) << mps;
  }
}

TEST(TurnedPath, FixesWithWrongStampsDoNotTurnThePath) {
  for (const double delay_s : {-2.0, -0.5, 0.5, 2.0}) {
    const auto late = [delay_s](double t) { return circle(t - delay_s); };
    EXPECT_FALSE(drive(circle, late).found()) << delay_s;
    const auto late_in_bend = [delay_s](double t) { return bend(t - delay_s); };
    EXPECT_FALSE(drive(bend, late_in_bend).found()) << delay_s;
    EXPECT_FALSE(drive(circle, late, 20.0, 0.1).found()) << delay_s;
    EXPECT_FALSE(drive(bend, late_in_bend, 20.0, 0.1).found()) << delay_s;
  }
}

TEST(TurnedPath, OnAStraightAWrongHeadingLooksLikeADrift) {
  EXPECT_FALSE(drive(turned(straight, radians(10.0)), straight).found());
}

TEST(TurnedPath, ACorrectHeadingAndAShortWayFindNothing) {
  EXPECT_FALSE(drive(bend, bend).found());
  EXPECT_FALSE(drive(bend, bend, 20.0, 0.1).found());
  EXPECT_FALSE(drive(turned(bend, radians(10.0)), bend, 6.0).found());
}

TEST(TurnedPath, AfterASilenceOfTheFixesThePathBeginsAgain) {
  TurnedPath path = drive(turned(bend, radians(10.0)), bend);
  ASSERT_TRUE(path.found());
  path.add(from_utime(1'000'000) + from_seconds(30.0), {Vec3::Zero(), Vec3::Zero(), 0.0},
           {Vec3::Zero(), 0.3});
  EXPECT_FALSE(path.found());
}

}  // namespace
}  // namespace rcs::wm

// A wrong heading and drifting fixes are distinguished by the shape of the path.
#include "modules/wm/turned_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

namespace rcs::wm {
namespace {

/// At 8 m/s; a bend to the left of 30 m radius after 5 s.
Vec3 bend(double t_s) {
  constexpr double kSpeed = 8.0, kRadius = 30.0;
  if (t_s < 5.0) return {kSpeed * t_s, 0.0, 0.0};
  const double angle = kSpeed * (t_s - 5.0) / kRadius;
  return {kSpeed * 5.0 + kRadius * std::sin(angle), kRadius * (1.0 - std::cos(angle)), 0.0};
}
Vec3 straight(double t_s) { return {8.0 * t_s, 0.0, 0.0}; }

using Path = std::function<Vec3(double)>;

TurnedPath drive(const Path& own, const Path& fix, double length_s = 15.0) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.3);
  TurnedPath path;
  for (int k = 0; k * 0.2 < length_s; ++k) {
    const double t = 0.2 * k;
    const Vec3 error(noise(random), noise(random), 0.0);
    path.add(from_utime(1'000'000) + from_seconds(t), own(t), fix(t) + error, 0.3);
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
    const Vec3 end = found->T_new_old * turned(bend, radians(-yaw_deg))(15.0);
    EXPECT_LT((end - bend(15.0)).norm(), 1.5) << yaw_deg;
  }
}

TEST(TurnedPath, FixesThatDriftDoNotTurnThePath) {
  for (const double mps : {0.2, 1.0, 3.0}) {
    const auto drifting = [mps](double t) -> Vec3 {
      return bend(t) + Vec3(0.6, 0.8, 0.0) * mps * t;
    };
    EXPECT_FALSE(drive(bend, drifting).found()) << mps;
  }
}

TEST(TurnedPath, OnAStraightAWrongHeadingLooksLikeADrift) {
  EXPECT_FALSE(drive(turned(straight, radians(10.0)), straight).found());
}

TEST(TurnedPath, ACorrectHeadingAndAShortWayFindNothing) {
  EXPECT_FALSE(drive(bend, bend).found());
  EXPECT_FALSE(drive(turned(bend, radians(10.0)), bend, 6.0).found());
}

TEST(TurnedPath, AfterASilenceOfTheFixesThePathBeginsAgain) {
  TurnedPath path = drive(turned(bend, radians(10.0)), bend);
  ASSERT_TRUE(path.found());
  path.add(from_utime(1'000'000) + from_seconds(20.0), Vec3::Zero(), Vec3::Zero(), 0.3);
  EXPECT_FALSE(path.found());
}

}  // namespace
}  // namespace rcs::wm

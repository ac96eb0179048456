// Registration of two clouds from a distant guess and without a guess: laws that hold without the
// true motion, and errors where the true motion is known.

#include "modules/registration/cloud_registration.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/point_scenes.h"

namespace rcs::registration {
namespace {

using test::Ground;
using test::moved;

double metres(const Pose& a, const Pose& b) { return (a.inverse() * b).p.norm(); }
double turn_rad(const Pose& a, const Pose& b) { return log_so3((a.inverse() * b).q).norm(); }

/// Rolling ground with two walls and some boxes, all different.
Points yard(int n, double noise_m, unsigned seed) {
  std::mt19937 rng(seed);
  Points points = test::scene(Ground::kRolling, true, n, noise_m, Vec3::Zero(), &rng);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const std::array<Vec3, 5> boxes = {Vec3(6, 7, 0), Vec3(-9, 4, 0), Vec3(3, -8, 0),
                                     Vec3(-14, -6, 0), Vec3(-4, 16, 0)};
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    for (int i = 0; i < n / 20; ++i) {
      const double side = i % 2 == 0 ? 1.0 : -1.0;
      const double half_m = 0.8 + 0.3 * static_cast<double>(k);
      const Vec3 at = i % 4 < 2 ? Vec3(side * half_m, half_m * u(rng), 1.0 + u(rng))
                                : Vec3(half_m * u(rng), side * half_m, 1.0 + u(rng));
      points.push_back((boxes[k] + at).cast<float>());
    }
  }
  return points;
}

struct Clouds {
  Points model = yard(20'000, 0.01, 1);
  Pose T = test::pose(1.5, -1.0, 0.3, 0.03, -0.02, 0.3);
  Points data = moved(T.inverse(), yard(8'000, 0.01, 2));
};

TEST(CloudRegistration, FindsTheMotionFromADistantGuess) {
  const Clouds c;
  for (const Pose& off : {Pose{}, test::pose(1.2, -0.9, 0.3, 0.05, -0.05, 0.15),
                          test::pose(-1.2, 1.0, -0.3, -0.05, 0.05, -0.15)}) {
    const CloudRegistration r = register_clouds(c.model, c.data, c.T * off, CloudParams{});
    ASSERT_TRUE(r.accepted);
    EXPECT_LT(metres(r.best.T_target_vehicle, c.T), 0.01);
    EXPECT_LT(turn_rad(r.best.T_target_vehicle, c.T), 0.001);
  }
}

TEST(CloudRegistration, MovingTheDataMovesTheResult) {
  const Clouds c;
  const Pose before = register_clouds(c.model, c.data, c.T, CloudParams{}).best.T_target_vehicle;
  const Pose M = test::pose(3.0, -2.0, 0.4, 0.1, -0.05, 0.8);
  const Pose after = register_clouds(c.model, moved(M, c.data), c.T * M.inverse(), CloudParams{})
                         .best.T_target_vehicle;
  EXPECT_LT(metres(after, before * M.inverse()), 0.01);
  EXPECT_LT(turn_rad(after, before * M.inverse()), 0.001);
}

TEST(CloudRegistration, SwappingTheCloudsInvertsTheResult) {
  const Clouds c;
  const Points other = moved(c.T.inverse(), yard(20'000, 0.01, 3));
  const Pose there = register_clouds(c.model, other, c.T, CloudParams{}).best.T_target_vehicle;
  const Pose back =
      register_clouds(other, c.model, c.T.inverse(), CloudParams{}).best.T_target_vehicle;
  EXPECT_LT(metres(there * back, Pose{}), 0.01);
  EXPECT_LT(turn_rad(there * back, Pose{}), 0.001);
}

CloudRegistration searched_globally(const Points& model, const Points& data, const Pose& guess) {
  CloudMatcher matcher(model, data, CloudParams{});
  return matcher.conclude(matcher.search_globally(guess));
}

TEST(CloudRegistration, FindsAnyHeadingAndReportsSuccess) {
  const Clouds c;
  for (int k = 0; k < 6; ++k) {
    const Pose off = test::pose(4.0 * std::cos(k), 4.0 * std::sin(k), 0.0, 0.02, 0.02, 1.0 * k);
    const CloudRegistration r = searched_globally(c.model, c.data, c.T * off);
    ASSERT_TRUE(r.accepted) << k;
    EXPECT_LT(metres(r.best.T_target_vehicle, c.T), 0.02) << k;
    EXPECT_LT(turn_rad(r.best.T_target_vehicle, c.T), 0.002) << k;
  }
}

TEST(CloudRegistration, AnAmbiguousSceneIsRejected) {
  // Four equal walls around a flat yard: every quarter turn fits as well.
  Points court;
  std::mt19937 rng(7);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (int i = 0; i < 20'000; ++i) {
    const double side = i % 4 < 2 ? 10.0 : -10.0;
    const Vec3 wall = i % 2 == 0 ? Vec3(side, 10.0 * u(rng), 1.5 + 1.5 * u(rng))
                                 : Vec3(10.0 * u(rng), side, 1.5 + 1.5 * u(rng));
    court.push_back(wall.cast<float>());
    court.push_back(Vec3(10.0 * u(rng), 10.0 * u(rng), 0.0).cast<float>());
  }
  const CloudRegistration r =
      searched_globally(court, court, test::pose(0.5, 0.3, 0.0, 0.0, 0.0, 0.9));
  EXPECT_FALSE(r.accepted);
  EXPECT_GT(r.ambiguity, 0.9);
  ASSERT_GE(r.ranked.size(), 4U) << "all four candidates are listed";
}

TEST(CloudRegistration, CloudsOfDifferentSitesAreRejected) {
  const Clouds c;
  Points elsewhere;
  std::mt19937 rng(9);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  for (int i = 0; i < 8000; ++i) {
    const double x = 25.0 * u(rng);
    const double y = 25.0 * u(rng);
    elsewhere.push_back(
        Vec3(x, y, 2.0 * std::sin(0.4 * x + 1.0) * std::sin(0.5 * y)).cast<float>());
  }
  EXPECT_FALSE(searched_globally(c.model, elsewhere, Pose{}).accepted);
}

TEST(CloudRegistration, DegenerateCloudsGetAResult) {
  const Clouds c;
  for (const Points& poor : test::poor_clouds()) {
    EXPECT_FALSE(register_clouds(poor, c.data, Pose{}, CloudParams{}).accepted);
    EXPECT_FALSE(register_clouds(poor, poor, Pose{}, CloudParams{}).accepted);
    const CloudRegistration r = register_clouds(c.model, poor, Pose{}, CloudParams{});
    EXPECT_TRUE(r.best.T_target_vehicle.finite());
    if (!poor.empty()) {
      EXPECT_FALSE(searched_globally(poor, c.data, Pose{}).accepted);
    }
  }
}

TEST(CloudRegistration, APlaneLeavesItsDirectionsUnobserved) {
  std::mt19937 rng(3);
  const Points a = test::scene(Ground::kFlat, false, 20'000, 0.01, Vec3::Zero(), &rng);
  const Points b = test::scene(Ground::kFlat, false, 8000, 0.01, Vec3::Zero(), &rng);
  const Registration r =
      register_clouds(a, b, test::pose(0.2, 0.1, 0.2, 0.02, 0.01, 0.1), CloudParams{}).best;
  EXPECT_EQ(r.stop, Stop::kDegenerate);
  EXPECT_LT(r.information(0, 0), 1e-6 * r.information(2, 2));
  EXPECT_NEAR(r.T_target_vehicle.p.z(), 0.0, 0.005);
}

}  // namespace
}  // namespace rcs::registration

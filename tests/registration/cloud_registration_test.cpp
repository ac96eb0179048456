// Registration of two clouds from a distant guess and without a guess: laws that hold without the
// true motion, and errors where the true motion is known.

#include "modules/registration/cloud_registration.h"

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <vector>

#include "tests/support/point_scenes.h"
#include "tools/base/threads.h"

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
    const Registration r = register_clouds(c.model, c.data, c.T * off, CloudParams{});
    ASSERT_TRUE(usable(r.stop));
    EXPECT_LT(metres(r.T_target_vehicle, c.T), 0.01);
    EXPECT_LT(turn_rad(r.T_target_vehicle, c.T), 0.001);
  }
}

TEST(CloudRegistration, MovingTheDataMovesTheResult) {
  const Clouds c;
  const Pose before = register_clouds(c.model, c.data, c.T, CloudParams{}).T_target_vehicle;
  const Pose M = test::pose(3.0, -2.0, 0.4, 0.1, -0.05, 0.8);
  const Pose after =
      register_clouds(c.model, moved(M, c.data), c.T * M.inverse(), CloudParams{}).T_target_vehicle;
  EXPECT_LT(metres(after, before * M.inverse()), 0.01);
  EXPECT_LT(turn_rad(after, before * M.inverse()), 0.001);
}

TEST(CloudRegistration, SwappingTheCloudsInvertsTheResult) {
  const Clouds c;
  const Points other = moved(c.T.inverse(), yard(20'000, 0.01, 3));
  const Pose there = register_clouds(c.model, other, c.T, CloudParams{}).T_target_vehicle;
  const Pose back = register_clouds(other, c.model, c.T.inverse(), CloudParams{}).T_target_vehicle;
  EXPECT_LT(metres(there * back, Pose{}), 0.01);
  EXPECT_LT(turn_rad(there * back, Pose{}), 0.001);
}

TEST(CloudRegistration, FindsAnyHeadingAndReportsSuccess) {
  const Clouds c;
  CloudMatcher matcher(c.model, CloudParams{});
  for (int k = 0; k < 6; ++k) {
    const Pose off = test::pose(4.0 * std::cos(k), 4.0 * std::sin(k), 0.0, 0.02, 0.02, 1.0 * k);
    const GlobalRegistration g = matcher.search_globally(c.data, c.T * off);
    ASSERT_TRUE(g.accepted) << k;
    EXPECT_LT(metres(g.best.T_target_vehicle, c.T), 0.02) << k;
    EXPECT_LT(turn_rad(g.best.T_target_vehicle, c.T), 0.002) << k;
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
  CloudMatcher matcher(court, CloudParams{});
  const GlobalRegistration g =
      matcher.search_globally(court, test::pose(0.5, 0.3, 0.0, 0.0, 0.0, 0.9));
  EXPECT_FALSE(g.accepted);
  EXPECT_GT(g.ambiguity, 0.97);
  ASSERT_GE(g.ranked.size(), 4U) << "all four candidates are listed";
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
  CloudMatcher matcher(c.model, CloudParams{});
  EXPECT_FALSE(matcher.search_globally(elsewhere, Pose{}).accepted);
}

TEST(CloudRegistration, StepwiseExecutionEqualsOneCall) {
  const Clouds c;
  RollingMap map{RollingMapParams{}};
  map.insert(c.model, Pose{});
  const WideMap wide(map, {});
  GlobalSearch at_once(c.data, &wide, c.T, {}, {});
  GlobalSearch in_pieces(c.data, &wide, c.T, {}, {});
  ASSERT_TRUE(at_once.go_on(1'000'000'000));
  int pieces = 1;
  while (!in_pieces.go_on(5000)) ++pieces;
  EXPECT_GT(pieces, 10);
  ASSERT_EQ(at_once.ranked().size(), in_pieces.ranked().size());
  for (std::size_t k = 0; k < at_once.ranked().size(); ++k) {
    const Pose& a = at_once.ranked()[k].T_target_vehicle;
    const Pose& b = in_pieces.ranked()[k].T_target_vehicle;
    EXPECT_EQ(a.p, b.p);
    EXPECT_EQ(a.q.coeffs(), b.q.coeffs());
  }
}

TEST(CloudRegistration, AnyNumberOfThreadsGivesTheSameBits) {
  const Clouds c;
  RollingMap map{RollingMapParams{}};
  map.insert(c.model, Pose{});
  const WideMap wide(map, {});
  std::vector<std::vector<Hypothesis>> answers;
  for (const int threads : {1, 2, 5}) {
    GlobalParams params;
    params.threads = threads;
    params.for_all = tools::in_threads;
    GlobalSearch search(c.data, &wide, c.T, params, {});
    ASSERT_TRUE(search.go_on(1'000'000'000));
    answers.push_back(search.ranked());
  }
  for (const std::vector<Hypothesis>& other : answers) {
    ASSERT_EQ(other.size(), answers[0].size());
    for (std::size_t k = 0; k < other.size(); ++k) {
      EXPECT_EQ(other[k].score, answers[0][k].score);
      EXPECT_EQ(other[k].T_target_vehicle.p, answers[0][k].T_target_vehicle.p);
      EXPECT_EQ(other[k].T_target_vehicle.q.coeffs(), answers[0][k].T_target_vehicle.q.coeffs());
    }
  }
}

TEST(CloudRegistration, AnnealingFindsANearbyPoseAndIsRepeatable) {
  const Clouds c;
  RollingMap map{RollingMapParams{}};
  map.insert(c.model, Pose{});
  const WideMap wide(map, {});
  const Pose guess = c.T * test::pose(2.0, 1.0, 0.0, 0.0, 0.0, 0.8);
  WorkUnits used = 0;
  const Hypothesis h = anneal(c.data, wide, guess, {}, {}, {}, &used);
  EXPECT_LT(metres(h.T_target_vehicle, c.T), 0.5);
  EXPECT_GT(used, 0);
  const Hypothesis again = anneal(c.data, wide, guess, {}, {}, {}, nullptr);
  EXPECT_EQ(h.T_target_vehicle.p, again.T_target_vehicle.p);
}

TEST(CloudRegistration, DegenerateCloudsGetAResult) {
  const Clouds c;
  for (const Points& poor : test::poor_clouds()) {
    EXPECT_FALSE(usable(register_clouds(poor, c.data, Pose{}, CloudParams{}).stop));
    EXPECT_FALSE(usable(register_clouds(poor, poor, Pose{}, CloudParams{}).stop));
    const Registration r = register_clouds(c.model, poor, Pose{}, CloudParams{});
    EXPECT_TRUE(r.T_target_vehicle.finite());
    if (poor.empty()) continue;
    CloudMatcher matcher(poor, CloudParams{});
    EXPECT_FALSE(matcher.search_globally(c.data, Pose{}).accepted);
  }
}

TEST(CloudRegistration, APlaneLeavesItsDirectionsUnobserved) {
  std::mt19937 rng(3);
  const Points a = test::scene(Ground::kFlat, false, 20'000, 0.01, Vec3::Zero(), &rng);
  const Points b = test::scene(Ground::kFlat, false, 8000, 0.01, Vec3::Zero(), &rng);
  const Registration r =
      register_clouds(a, b, test::pose(0.2, 0.1, 0.2, 0.02, 0.01, 0.1), CloudParams{});
  EXPECT_EQ(r.stop, Stop::kDegenerate);
  EXPECT_LT(r.information(0, 0), 1e-6 * r.information(2, 2));
  EXPECT_NEAR(r.T_target_vehicle.p.z(), 0.0, 0.005);
}

}  // namespace
}  // namespace rcs::registration

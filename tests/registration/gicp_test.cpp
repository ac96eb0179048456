#include "modules/registration/gicp.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

#include "tests/support/point_scenes.h"

namespace rcs::registration {
namespace {

using test::Ground;
using test::moved;

double metres(const Pose& a, const Pose& b) { return (a.inverse() * b).p.norm(); }
double turn_rad(const Pose& a, const Pose& b) { return log_so3((a.inverse() * b).q).norm(); }

Points walled(int n, unsigned seed) {
  std::mt19937 rng(seed);
  return test::scene(Ground::kRolling, true, n, 0.01, Vec3::Zero(), &rng);
}

/// Other points of the same surfaces.
struct Clouds {
  Pose T = test::pose(1.5, -1.0, 0.3, 0.03, -0.02, 0.3);
  Points model = walled(20'000, 1);
  Points data = moved(T.inverse(), walled(20'000, 2));
};

// Points of a surface are some 0.3 m apart and the ground is bent: discs deviate from it by 1 cm.
constexpr double kTolerance_m = 0.01;
constexpr double kTolerance_rad = 0.001;

void expect_same(const Pose& a, const Pose& b) {
  EXPECT_LT(metres(a, b), kTolerance_m);
  EXPECT_LT(turn_rad(a, b), kTolerance_rad);
}

TEST(Gicp, FindsTheMotion) {
  const Clouds c;
  const GicpCloud model(c.model, GicpParams{});
  const GicpCloud data(c.data, GicpParams{});
  for (const Pose& off : {Pose{}, test::pose(0.8, -0.5, 0.2, 0.02, -0.02, 0.04),
                          test::pose(-0.5, 0.9, -0.3, 0, 0, -0.03)}) {
    const Registration r = register_gicp(model, data, c.T * off, GicpParams{});
    ASSERT_EQ(r.stop, Stop::kConverged);
    expect_same(r.T_target_vehicle, c.T);
    EXPECT_GT(r.overlap, 0.7);
    EXPECT_GT(r.pairs, 5000);
    EXPECT_LE(r.pairs, r.points);
    EXPECT_LT(r.mean_distance_m, 0.05);
    EXPECT_GE(r.rms_m, r.mean_distance_m);
    EXPECT_NEAR(r.correction_m, off.p.norm(), 0.05);
  }
}

TEST(Gicp, MovingTheDataMovesTheResult) {
  const Clouds c;
  const Pose before = register_gicp(c.model, c.data, c.T, GicpParams{}).T_target_vehicle;
  const Pose M = test::pose(3.0, -2.0, 0.4, 0.1, -0.05, 0.8);
  const Pose after =
      register_gicp(c.model, moved(M, c.data), c.T * M.inverse(), GicpParams{}).T_target_vehicle;
  expect_same(after, before * M.inverse());
}

TEST(Gicp, SwappingTheCloudsInvertsTheResult) {
  const Clouds c;
  const Pose there = register_gicp(c.model, c.data, c.T, GicpParams{}).T_target_vehicle;
  const Pose back = register_gicp(c.data, c.model, c.T.inverse(), GicpParams{}).T_target_vehicle;
  expect_same(there * back, Pose{});
}

TEST(Gicp, TheSameInputGivesTheSameBits) {
  const Clouds c;
  const Registration a = register_gicp(c.model, c.data, c.T, GicpParams{});
  const Registration b = register_gicp(c.model, c.data, c.T, GicpParams{});
  EXPECT_EQ(a.T_target_vehicle.p, b.T_target_vehicle.p);
  EXPECT_EQ(a.T_target_vehicle.q.coeffs(), b.T_target_vehicle.q.coeffs());
  EXPECT_EQ(a.information, b.information);
}

TEST(Gicp, JacobianIsTheDerivativeOfTheDifference) {
  std::mt19937 rng(1);
  std::normal_distribution<double> noise;
  const auto random3 = [&] { return Vec3(noise(rng), noise(rng), noise(rng)); };
  for (int k = 0; k < 20; ++k) {
    const Pose T = test::pose(noise(rng), noise(rng), noise(rng), 0.1, 0.2, noise(rng));
    const Mat3 R = T.rotation();
    const GicpPoint data{10.0 * random3(), random3().normalized(), 0.0};
    const GicpPoint model{T * data.p + 0.1 * random3(), random3().normalized(), 0.0};
    const auto difference = [&](const Vec6& xi) -> Vec3 {
      return R.transpose() * (T * exp_se3(xi) * data.p - model.p);
    };
    const GicpTerm term = gicp_term(data, model, T);
    EXPECT_LT((term.d - difference(Vec6::Zero())).norm(), 1e-12);
    for (int i = 0; i < 6; ++i) {
      const double h = 1e-6;
      const Vec3 numeric =
          (difference(h * Vec6::Unit(i)) - difference(-h * Vec6::Unit(i))) / (2.0 * h);
      EXPECT_LT((term.J.col(i) - numeric).norm(), 1e-6);
    }
  }
}

TEST(Gicp, TheMetricIsThatOfBothDiscs) {
  // C_data + R' C_model R, with the eigenvalues of a disc in the paper.
  const auto disc = [](const Vec3& normal) -> Mat3 {
    const Mat3 axes = Quat::FromTwoVectors(Vec3::UnitX(), normal).toRotationMatrix();
    return axes * Vec3(1e-3, 1.0, 1.0).asDiagonal() * axes.transpose();
  };
  const Pose T = test::pose(1.0, 2.0, 3.0, 0.3, -0.2, 1.0);
  const Mat3 R = T.rotation();
  const GicpPoint data{Vec3(4, 5, 6), Vec3(1, 2, -2).normalized(), 0.0};
  const GicpPoint model{Vec3(1, 1, 1), Vec3(0.2, -1, 0.5).normalized(), 0.0};
  const Mat3 C = disc(data.normal) + R.transpose() * disc(model.normal) * R;
  const Mat3 M = gicp_term(data, model, T).M;
  EXPECT_LT((M * C - Mat3::Identity()).norm(), 1e-9);
  // Which side a normal points to does not matter.
  GicpPoint turned = data;
  turned.normal = -data.normal;
  EXPECT_LT((gicp_term(turned, model, T).M - M).norm(), 1e-9);
}

TEST(Gicp, DegenerateCloudsGetAResult) {
  const Clouds c;
  const Pose guess = test::pose(0.1, 0.2, 0.3, 0.0, 0.0, 0.1);
  for (const Points& poor : test::poor_clouds()) {
    const Stop expected = poor.empty() ? Stop::kEmpty : Stop::kTooFew;
    for (const Registration& r : {register_gicp(poor, c.data, guess, GicpParams{}),
                                  register_gicp(c.model, poor, guess, GicpParams{}),
                                  register_gicp(poor, poor, guess, GicpParams{})}) {
      EXPECT_EQ(r.stop, expected);
      EXPECT_EQ(r.T_target_vehicle.p, guess.p) << "the guess is kept";
      EXPECT_TRUE(r.information.isZero(0.0));
    }
  }
}

TEST(Gicp, TriplicatedPointsChangeNothing) {
  const Clouds c;
  const auto thrice = [](const Points& points) {
    Points out;
    for (std::size_t i = 0; i < points.size(); ++i) {
      for (int k = 0; k < 3; ++k) out.push_back(points[i]);
    }
    return out;
  };
  const Registration once = register_gicp(c.model, c.data, c.T, GicpParams{});
  const Registration more = register_gicp(thrice(c.model), thrice(c.data), c.T, GicpParams{});
  EXPECT_EQ(once.T_target_vehicle.p, more.T_target_vehicle.p);
}

TEST(Gicp, AResultFarFromTheGuessIsReportedAsDiverged) {
  const Clouds c;
  GicpParams params;
  params.max_correction_m = 0.3;
  const Pose guess = c.T * test::pose(0.5, 0.5, 0.0, 0.0, 0.0, 0.0);
  const Registration r = register_gicp(c.model, c.data, guess, params);
  EXPECT_EQ(r.stop, Stop::kDiverged);
  EXPECT_EQ(r.T_target_vehicle.p, guess.p);
  EXPECT_GT(r.correction_m, 0.3);
}

TEST(Gicp, TheIterationLimitIsReported) {
  const Clouds c;
  GicpParams params;
  params.max_iterations = 3;
  const Registration r = register_gicp(c.model, c.data, c.T, params);
  EXPECT_EQ(r.stop, Stop::kMaxIterations);
  EXPECT_EQ(r.iterations, 3);
}

TEST(Gicp, AFlatFieldLeavesItsDirectionsAtTheGuess) {
  for (const double noise_m : {0.0, 0.01, 0.03}) {
    std::mt19937 rng(3);
    const Points a = test::scene(Ground::kFlat, false, 20'000, noise_m, Vec3::Zero(), &rng);
    const Points b = test::scene(Ground::kFlat, false, 20'000, noise_m, Vec3::Zero(), &rng);
    const Pose guess = test::pose(0.2, 0.1, 0.2, 0.02, 0.01, 0.1);
    const Registration r = register_gicp(a, b, guess, GicpParams{});
    ASSERT_EQ(r.stop, Stop::kDegenerate) << noise_m;
    EXPECT_LT(r.information(0, 0), 1e-3 * r.information(2, 2));
    EXPECT_LT(r.information(1, 1), 1e-3 * r.information(2, 2));
    EXPECT_LT(r.information(5, 5), 1e-3 * r.information(3, 3));
    const Pose& T = r.T_target_vehicle;
    EXPECT_NEAR(T.p.z(), 0.0, 0.005);
    EXPECT_LT(std::hypot((T.q * Vec3::UnitZ()).x(), (T.q * Vec3::UnitZ()).y()), 0.001);
    EXPECT_NEAR(T.p.x(), guess.p.x(), 0.02);
    EXPECT_NEAR(T.p.y(), guess.p.y(), 0.02);
    EXPECT_NEAR(yaw_of(T.q), yaw_of(guess.q), 0.002);
  }
}

Points corridor(int n, double noise_m, std::mt19937* rng) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, noise_m);
  Points points;
  for (int i = 0; i < n; ++i) {
    const double x = 30.0 * u(*rng);
    const double side = i % 4 == 1 ? 3.0 : -3.0;
    const Vec3 p = i % 2 == 0 ? Vec3(x, 3.0 * u(*rng), noise(*rng))
                              : Vec3(x, side + noise(*rng), 1.5 + 1.5 * u(*rng));
    points.push_back(p.cast<float>());
  }
  return points;
}

TEST(Gicp, ACorridorLeavesItsLengthAtTheGuess) {
  for (const double noise_m : {0.0, 0.01, 0.03}) {
    std::mt19937 rng(5);
    const Points a = corridor(20'000, noise_m, &rng);
    const Points b = corridor(20'000, noise_m, &rng);
    const Pose guess = test::pose(0.4, 0.3, -0.2, 0.01, -0.01, 0.03);
    const Registration r = register_gicp(a, b, guess, GicpParams{});
    ASSERT_EQ(r.stop, Stop::kDegenerate) << noise_m;
    EXPECT_LT(r.information(0, 0), 1e-3 * r.information(1, 1));
    EXPECT_NEAR(r.T_target_vehicle.p.x(), guess.p.x(), 0.02);
    EXPECT_NEAR(r.T_target_vehicle.p.y(), 0.0, 0.005);
    EXPECT_NEAR(r.T_target_vehicle.p.z(), 0.0, 0.005);
    EXPECT_LT(turn_rad(r.T_target_vehicle, Pose{}), 0.002);
  }
}

TEST(Gicp, ErrorsAreConsistentWithTheCovariance) {
  double nees = 0.0;
  constexpr int kTrials = 20;
  for (unsigned k = 0; k < kTrials; ++k) {
    const Registration r =
        register_gicp(walled(6000, 100 + 2 * k), walled(6000, 101 + 2 * k), Pose{}, GicpParams{});
    ASSERT_EQ(r.stop, Stop::kConverged);
    const Vec6 error = log_se3(r.T_target_vehicle);
    nees += error.dot(r.information * error) / (6.0 * kTrials);
  }
  // It is 1.7: the correlation of the points of a disc is not modelled.
  EXPECT_LT(nees, 3.0);
  EXPECT_GT(nees, 0.3);
}

}  // namespace
}  // namespace rcs::registration

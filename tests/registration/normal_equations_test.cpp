#include "modules/registration/normal_equations.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/point_scenes.h"

namespace rcs::registration {
namespace {

TEST(NormalEquations, JacobianIsTheDerivativeOfTheResidual) {
  std::mt19937 rng(1);
  std::normal_distribution<double> noise;
  const auto random3 = [&] { return Vec3(noise(rng), noise(rng), noise(rng)); };
  for (int k = 0; k < 20; ++k) {
    const Pose T = test::pose(noise(rng), noise(rng), noise(rng), 0.1, 0.2, noise(rng));
    const Vec3 p = 10.0 * random3();
    const Vec3 n = random3().normalized();
    const Vec3 mean = T * p + 0.1 * random3();
    const auto residual = [&](const Vec6& xi) { return n.dot(T * exp_se3(xi) * p - mean); };
    // With one residual, H = J'J and b = J'r, so that J = b / r.
    NormalEquations one;
    const double r = residual(Vec6::Zero());
    one.add(p, T.q.conjugate() * n, r, 1.0);
    for (int i = 0; i < 6; ++i) {
      const double h = 1e-6;
      const double numeric = (residual(h * Vec6::Unit(i)) - residual(-h * Vec6::Unit(i))) / (2 * h);
      EXPECT_NEAR(one.b[i] / r, numeric, 1e-6);
    }
  }
}

NormalEquations random_equations(const Vec6& spread) {
  std::mt19937 rng(3);
  std::normal_distribution<double> noise;
  NormalEquations e;
  for (int k = 0; k < 500; ++k) {
    const Vec3 n = Vec3(spread[0] * noise(rng), spread[1] * noise(rng), spread[2] * noise(rng));
    e.add(10.0 * Vec3(noise(rng), noise(rng), 0.1 * noise(rng)), n.normalized(), noise(rng), 1.0);
  }
  e.close();
  return e;
}

TEST(NormalEquations, FullyObservedStepIsGaussNewtons) {
  Vec6 all;
  all.setOnes();
  const NormalEquations e = random_equations(all);
  const Observability obs = observability(e, 1e-4, 10.0);
  ASSERT_EQ(obs.unobserved, 0);
  const Vec6 expected = -e.H.ldlt().solve(e.b);
  EXPECT_LT((observed_step(e, obs, Vec6::Ones()) - expected).norm(), 1e-9);
  EXPECT_EQ(observed_part(e.H, obs), e.H);
}

TEST(NormalEquations, UnobservedDirectionsFollowThePrediction) {
  Vec6 flat;
  flat << 1e-6, 1e-6, 1.0, 0, 0, 0;  // all normals point up
  const NormalEquations e = random_equations(flat);
  const Observability obs = observability(e, 1e-4, 10.0);
  ASSERT_EQ(obs.unobserved, 3);
  Vec6 back;
  back << 0.5, -0.25, 0.1, 0.0, 0.0, 0.02;
  const Vec6 step = observed_step(e, obs, back);
  EXPECT_NEAR(step[0], 0.5, 1e-3);
  EXPECT_NEAR(step[1], -0.25, 1e-3);
  EXPECT_NEAR(step[5], 0.02, 1e-4);
  const Mat6 information = observed_part(e.H, obs);
  EXPECT_LT(information(0, 0) + information(1, 1) + information(5, 5), 1e-3 * information(2, 2));
  EXPECT_GT(information(2, 2), 0.5 * e.H(2, 2));
}

TEST(NormalEquations, WhatTheErrorsOfNormalsPretendIsNoInformation) {
  NormalEquations e;
  e.H = 100.0 * Mat6::Identity();
  e.weight = 100.0;
  for (const double share : {0.0, 0.1, 0.25, 0.49}) {
    e.noise = share * e.H;
    const Observability obs = observability(e, 1e-4, 0.5);
    ASSERT_EQ(obs.unobserved, 0) << share;
    const double weight = 1.0 - 2.0 * share;
    const Mat6 expected = weight * weight * e.H;
    EXPECT_LT((observed_part(e.H, obs) - expected).norm(), 1e-9) << share;
  }
  e.noise = 0.51 * e.H;
  EXPECT_EQ(observability(e, 1e-4, 0.5).unobserved, 6);
}

}  // namespace
}  // namespace rcs::registration

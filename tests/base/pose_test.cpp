#include "rcs/base/pose.h"

#include <gtest/gtest.h>

#include <random>

namespace rcs {
namespace {

Vec6 random_twist(std::mt19937* rng, double metres, double angle) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  Vec6 xi;
  for (int i = 0; i < 3; ++i) xi[i] = metres * u(*rng);
  for (int i = 3; i < 6; ++i) xi[i] = angle * u(*rng);
  return xi;
}

TEST(Pose, LogUndoesExp) {
  std::mt19937 rng(1);
  for (const double angle : {1e-9, 1e-5, 1e-3, 0.1, 1.7}) {
    for (int k = 0; k < 200; ++k) {
      const Vec6 xi = random_twist(&rng, 10.0, angle);
      EXPECT_LT((log_se3(exp_se3(xi)) - xi).norm(), 1e-7) << angle;
    }
  }
}

TEST(Pose, ExpOfPureTranslationIsTheTranslation) {
  Vec6 xi;
  xi << 1.0, -2.0, 3.0, 0.0, 0.0, 0.0;
  EXPECT_LT((exp_se3(xi).p - Vec3(1.0, -2.0, 3.0)).norm(), 1e-15);
}

TEST(Pose, InverseComposesToIdentity) {
  std::mt19937 rng(2);
  for (int k = 0; k < 200; ++k) {
    const Pose T = exp_se3(random_twist(&rng, 100.0, 1.8));
    const Pose I = T * T.inverse();
    EXPECT_LT(I.p.norm(), 1e-12 * 1e3);
    EXPECT_LT(log_so3(I.q).norm(), 1e-12);
  }
}

TEST(Pose, AdjointMovesAPerturbationFromRightToLeft) {
  std::mt19937 rng(3);
  for (int k = 0; k < 100; ++k) {
    const Pose T = exp_se3(random_twist(&rng, 5.0, 1.5));
    const Vec6 xi = random_twist(&rng, 0.3, 0.3);
    const Pose right = T * exp_se3(xi);
    const Pose left = exp_se3(adjoint(T) * xi) * T;
    EXPECT_LT((right.p - left.p).norm(), 1e-12);
    EXPECT_LT(log_so3(right.q.conjugate() * left.q).norm(), 1e-12);
  }
}

TEST(Pose, RightJacobianIsTheDerivativeOfExp) {
  std::mt19937 rng(4);
  for (const double angle : {1e-5, 0.02, 1.2}) {
    const Vec3 phi = random_twist(&rng, 1.0, angle).tail<3>();
    Mat3 numeric;
    const double h = 1e-6;
    for (int i = 0; i < 3; ++i) {
      const Quat plus = exp_so3(phi).conjugate() * exp_so3(phi + h * Vec3::Unit(i));
      const Quat minus = exp_so3(phi).conjugate() * exp_so3(phi - h * Vec3::Unit(i));
      numeric.col(i) = (log_so3(plus) - log_so3(minus)) / (2.0 * h);
    }
    EXPECT_LT((numeric - right_jacobian_so3(phi)).norm(), 1e-8) << angle;
    EXPECT_LT((right_jacobian_so3(phi) * right_jacobian_inverse_so3(phi) - Mat3::Identity()).norm(),
              1e-9);
  }
}

TEST(Pose, InterpolationIsExactAtBothEnds) {
  std::mt19937 rng(5);
  const Pose a = exp_se3(random_twist(&rng, 5.0, 1.0));
  const Pose b = exp_se3(random_twist(&rng, 5.0, 1.0));
  EXPECT_LT((interpolate(a, b, 0.0).p - a.p).norm(), 1e-12);
  EXPECT_LT((interpolate(a, b, 1.0).p - b.p).norm(), 1e-12);
}

}  // namespace
}  // namespace rcs

#include "modules/registration/rigid_motion.h"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/point_scenes.h"

namespace rcs::registration {
namespace {

struct Pairs {
  /// p anywhere (`flat`: in a plane), q = T p + noise.
  Pairs(unsigned seed, int n, const Pose& T, double noise_m, bool flat = false) : rng(seed) {
    std::uniform_real_distribution<double> u(-20.0, 20.0);
    std::normal_distribution<double> noise(0.0, noise_m);
    for (int i = 0; i < n; ++i) {
      const Vec3 p(1000.0 + u(rng), u(rng), flat ? 0.0 : u(rng));
      sums.add(p, T * p + Vec3(noise(rng), noise(rng), noise(rng)), 0.5 + 0.01 * (i % 7));
    }
  }
  std::mt19937 rng;
  PointPairMoments sums;
};

const Pose kTruth = test::pose(3.0, -2.0, 1.0, 0.3, -0.2, 2.5);

TEST(RigidMotion, BothSolversFindTheMotion) {
  const Pairs pairs(1, 100, kTruth, 0.0);
  for (const RigidMotion& m : {motion_by_svd(pairs.sums), motion_by_quaternion(pairs.sums)}) {
    EXPECT_LT((m.R - kTruth.rotation()).norm(), 1e-9);
    EXPECT_LT((m.T - kTruth.p).norm(), 1e-6) << "1000 m from the origin";
    EXPECT_FALSE(m.degenerate);
    EXPECT_FALSE(m.reflection);
  }
}

// Errata 10: both minimize the same cost.
TEST(RigidMotion, SvdAndQuaternionAgree) {
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Pairs pairs(seed, 30, kTruth, 0.5, seed % 2 == 0);
    const RigidMotion a = motion_by_svd(pairs.sums);
    const RigidMotion b = motion_by_quaternion(pairs.sums);
    EXPECT_LT((a.R - b.R).norm(), 1e-9) << seed;
    EXPECT_LT((a.T - b.T).norm(), 1e-6) << seed;
  }
}

// Errata 2: this happens on flat fields.
TEST(RigidMotion, NoisyPlanesGiveReflectionsUnlessGuarded) {
  int reflections = 0;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Pairs pairs(seed, 30, test::pose(0.1, 0.0, 0.0, 0.0, 0.0, 0.05), 0.15, true);
    const RigidMotion printed = motion_by_svd(pairs.sums, false);
    const RigidMotion guarded = motion_by_svd(pairs.sums);
    EXPECT_EQ(printed.reflection, printed.R.determinant() < 0.0);
    EXPECT_NEAR(guarded.R.determinant(), 1.0, 1e-9);
    EXPECT_FALSE(guarded.reflection);
    if (!printed.reflection) {
      EXPECT_LT((printed.R - guarded.R).norm(), 1e-12);
    }
    reflections += printed.reflection ? 1 : 0;
  }
  EXPECT_GT(reflections, 20);
  EXPECT_LT(reflections, 180);
}

TEST(RigidMotion, ALineIsDegenerateAndAPlaneIsNot) {
  PointPairMoments line;
  for (int i = 0; i < 10; ++i) {
    line.add(i * Vec3(1.0, 2.0, 3.0), kTruth * (i * Vec3(1.0, 2.0, 3.0)));
  }
  EXPECT_TRUE(motion_by_svd(line).degenerate);
  EXPECT_TRUE(motion_by_quaternion(line).degenerate);
  PointPairMoments point;
  for (int i = 0; i < 10; ++i) point.add(Vec3(1.0, 2.0, 3.0), Vec3(2.0, 2.0, 3.0));
  EXPECT_TRUE(motion_by_svd(point).degenerate);
  EXPECT_TRUE(motion_by_quaternion(point).degenerate);
  const Pairs plane(1, 100, kTruth, 0.0, true);
  EXPECT_FALSE(motion_by_svd(plane.sums).degenerate);
  EXPECT_LT((motion_by_svd(plane.sums).R - kTruth.rotation()).norm(), 1e-9);
}

}  // namespace
}  // namespace rcs::registration

#include "modules/registration/pair_sums.h"

#include <gtest/gtest.h>

#include <random>

namespace rcs::registration {
namespace {

TEST(PairSums, EqualTheScalarSumsInDouble) {
  // Numbers of points that do not fill whole SIMD lanes, and some that do.
  for (const int count : {1, 7, 8, 9, 1000}) {
    std::mt19937 rng(5);
    std::normal_distribution<float> noise;
    const auto random3 = [&] { return Vec3f(noise(rng), noise(rng), noise(rng)); };
    PairSums sums;
    NormalEquations expected;
    Mat6 noise_sum = Mat6::Zero();
    for (int k = 0; k < count; ++k) {
      const Vec3f p = 20.0F * random3();
      const Vec3f n = random3().normalized();
      const float r = 0.1F * noise(rng);
      const float w = 1.0F + std::abs(noise(rng));
      const float v = 0.01F * std::abs(noise(rng));
      sums.add(p, n, w * r, w, w * v);
      expected.add(p.cast<double>(), n.cast<double>(), double{r}, double{w});
      // dJ = (dn, p x dn) with cov(dn) = v (I - n n').
      Eigen::Matrix<double, 6, 3> A;
      A << Mat3::Identity(), hat(p.cast<double>());
      const Vec3 normal = n.cast<double>();
      noise_sum += double{w} * double{v} * A * (Mat3::Identity() - normal * normal.transpose()) *
                   A.transpose();
    }
    expected.close();
    const NormalEquations e = sums.finish();
    EXPECT_LT((e.H - expected.H).norm(), 1e-5 * expected.H.norm()) << count;
    EXPECT_LT((e.b - expected.b).norm(), 1e-5 * expected.H.norm()) << count;
    EXPECT_LT((e.noise - noise_sum).norm(), 1e-5 * noise_sum.norm()) << count;
    EXPECT_NEAR(e.weight, expected.weight, 1e-5 * expected.weight) << count;
    EXPECT_EQ(e.H, e.H.transpose());
  }
}

}  // namespace
}  // namespace rcs::registration

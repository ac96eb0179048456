#include "tools/smoothing/preintegration.h"

#include <gtest/gtest.h>
#include <cstdint>

#include <cmath>

namespace rcs::smoothing {
namespace {

constexpr double kInterval_s = 0.01;

/// Samples of a constant rate and a constant force in the vehicle's axes.
std::vector<InertialIncrement> constant(const Vec3& rate, const Vec3& force, int count) {
  std::vector<InertialIncrement> samples;
  for (int k = 1; k <= count; ++k) {
    samples.push_back({from_utime(std::int64_t{k} * 10'000), kInterval_s, rate * kInterval_s,
                       force * kInterval_s});
  }
  return samples;
}

TEST(Preintegration, ACircleReturnsToItsStart) {
  // Speed 5 m/s, a turn in 2 s: the force is to the left, v * rate.
  const double rate = kPi;
  const std::vector<InertialIncrement> samples =
      constant(Vec3(0, 0, rate), Vec3(0, 5.0 * rate, 0), 200);
  const Preintegrated all = preintegrate(samples, from_utime(0), from_utime(2'000'000), {}, {});
  EXPECT_NEAR(all.dt_s, 2.0, 1e-12);
  EXPECT_LT(log_so3(all.turn).norm(), 1e-9);
  EXPECT_LT(all.dv.norm(), 1e-9);
  // p = v0 t + dp = 0 for v0 = 5 m/s ahead, but for the steps' curvature.
  EXPECT_LT((Vec3(5.0, 0, 0) * 2.0 + all.dp).norm(), 1e-3);
}

TEST(Preintegration, PartialSamplesCountInProportion) {
  const std::vector<InertialIncrement> samples = constant(Vec3(0, 0, 0.3), Vec3(1, 0, 9.8), 30);
  const auto between = [&](int from_us, int to_us) {
    return preintegrate(samples, from_utime(from_us), from_utime(to_us), {}, {});
  };
  const Preintegrated whole = between(13'000, 217'000);
  const Preintegrated a = between(13'000, 101'000);
  const Preintegrated b = between(101'000, 217'000);
  EXPECT_NEAR(whole.dt_s, 0.204, 1e-12);
  EXPECT_LT(log_so3(whole.turn.conjugate() * (a.turn * b.turn)).norm(), 1e-12);
  EXPECT_LT((whole.dv - (a.dv + a.turn * b.dv)).norm(), 1e-5);
  EXPECT_LT((whole.dp - (a.dp + a.dv * b.dt_s + a.turn * b.dp)).norm(), 1e-6);
}

TEST(Preintegration, DerivativesByTheSensorErrorsMatchNumericalDifferences) {
  std::vector<InertialIncrement> samples = constant(Vec3(0.2, -0.1, 0.5), Vec3(2, 1, 9.8), 50);
  const auto at = [&](const InertialErrors& e) {
    return preintegrate(samples, from_utime(0), from_utime(500'000), e, {});
  };
  const Preintegrated zero = at({});
  constexpr double kStep = 1e-6;
  for (int k = 0; k < kInertialErrors; ++k) {
    InertialErrors e;
    if (k < 3) e.gyro_bias_radps[k] = kStep;
    if (k >= 3 && k < 6) e.accel_bias_mps2[k - 3] = kStep;
    if (k >= 6 && k < 9) e.gyro_scale[k - 6] = kStep;
    if (k >= 9) e.accel_gain((k - 9) / 3, (k - 9) % 3) = kStep;
    EXPECT_EQ(as_vector(e)[k], kStep);
    const Preintegrated there = at(e);
    Vec<9> difference;
    difference << log_so3(zero.turn.conjugate() * there.turn), there.dv - zero.dv,
        there.dp - zero.dp;
    EXPECT_LT((difference / kStep - zero.by_errors.col(k)).norm(),
              5e-3 * zero.by_errors.col(k).norm())
        << "error " << k;
  }
}

TEST(Preintegration, NoiseGrowsAsARandomWalk) {
  const std::vector<InertialIncrement> samples = constant(Vec3::Zero(), Vec3::Zero(), 400);
  const InertialNoise noise{1e-3, 1e-2};
  const Preintegrated m = preintegrate(samples, from_utime(0), from_utime(4'000'000), {}, noise);
  EXPECT_NEAR(std::sqrt(m.covariance(2, 2)), 1e-3 * 2.0, 1e-9);
  EXPECT_NEAR(std::sqrt(m.covariance(4, 4)), 1e-2 * 2.0, 1e-8);
  EXPECT_NEAR(std::sqrt(m.covariance(7, 7)), 1e-2 * std::sqrt(64.0 / 3.0), 1e-4);
}

TEST(Preintegration, AGapIsNotBridged) {
  std::vector<InertialIncrement> samples = constant(Vec3::Zero(), Vec3::Zero(), 50);
  samples.erase(samples.begin() + 20, samples.begin() + 25);
  const Stamp to = from_utime(500'000);
  EXPECT_EQ(preintegrate(samples, from_utime(0), to, {}, {}).dt_s, 0.0);
  EXPECT_EQ(preintegrate(samples, from_utime(300'000), from_utime(600'000), {}, {}).dt_s, 0.0);
  EXPECT_EQ(preintegrate({}, from_utime(0), to, {}, {}).dt_s, 0.0);
  EXPECT_NEAR(preintegrate(samples, from_utime(250'000), to, {}, {}).dt_s, 0.25, 1e-12);
}

}  // namespace
}  // namespace rcs::smoothing

// A drift of the fixes and a wrong heading of the filter are distinguished by their velocities.
#include "modules/wm/fault_detection/fix_drift.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace rcs::wm {
namespace {

constexpr double kSigma_mps = 0.1;
constexpr double kHeading_rad = 0.03;
constexpr double kUnlikely = 9.21;  // chi-square, 99 %, 2 dof
constexpr double kSpeed_mps = 8.0;

Mat<2, 2> own() { return 4e-4 * Mat<2, 2>::Identity(); }

/// 40 fixes, 0.2 s apart, of a vehicle that drives at 8 m/s and turns to the left.
FixDrift fixes(const Vec2& drift_mps, double psi_rad, double turn_radps, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, kSigma_mps);
  FixDrift out;
  for (int i = 0; i < 40; ++i) {
    const double course = 0.2 * i * turn_radps;
    const Vec2 v = kSpeed_mps * Vec2(std::cos(course), std::sin(course));
    const Vec2 turned = psi_rad * Vec2(-v.y(), v.x());
    out.add(drift_mps + turned + Vec2(noise(random), noise(random)), v, kSigma_mps);
  }
  return out;
}

TEST(FixDrift, NoiseAloneIsChiSquareDistributedAtMost) {
  constexpr int kTrials = 1000;
  int unlikely = 0;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    if (fixes(Vec2::Zero(), 0.0, 0.1, seed).squared_mahalanobis(kHeading_rad, own()) > kUnlikely) {
      ++unlikely;
    }
  }
  EXPECT_LE(unlikely, kTrials / 50);
}

TEST(FixDrift, AWrongHeadingIsNone) {
  for (const double turn_radps : {0.0, 0.1, -0.2}) {
    const FixDrift wrong = fixes(Vec2::Zero(), kHeading_rad, turn_radps, 1);
    EXPECT_LT(wrong.squared_mahalanobis(kHeading_rad, own()), kUnlikely) << turn_radps;
  }
}

TEST(FixDrift, ADriftAlongTheMotionIsFound) {
  EXPECT_GT(fixes({0.2, 0.0}, 0.0, 0.0, 1).squared_mahalanobis(kHeading_rad, own()), kUnlikely);
}

TEST(FixDrift, ADriftAcrossTheMotionIsFoundOnABendOnly) {
  const Vec2 across(0.0, 0.3);
  EXPECT_LT(fixes(across, 0.0, 0.0, 1).squared_mahalanobis(kHeading_rad, own()), kUnlikely);
  EXPECT_GT(fixes(across, 0.0, 0.2, 1).squared_mahalanobis(kHeading_rad, own()), kUnlikely);
}

TEST(FixDrift, OfNoFixIsUnknown) {
  EXPECT_EQ(FixDrift{}.squared_mahalanobis(kHeading_rad, own()), 0.0);
}

}  // namespace
}  // namespace rcs::wm

// Broken ground, over which the constant rate of a sub-filter without INS is wrong: the protection
// levels do not rise without a fault.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "rcs/base/geodesy.h"
#include "tests/wm/fault_drive.h"

namespace rcs::wm {
namespace {

TEST(RoughGround, EdgesDoNotRaiseTheProtectionLevel) {
  const double smooth_m = drive(60.0, {}).highest_level_up_m;
  const Seen rough = drive(60.0, {}, 1, 20.0, radians(-20.0));
  std::printf("vertical level: %.2f m, on smooth ground %.2f m\n", rough.highest_level_up_m,
              smooth_m);
  EXPECT_LT(rough.highest_level_up_m, 1.5 * smooth_m);
  EXPECT_EQ(rough.above_protection, 0);
  EXPECT_TRUE(rough.findings.empty());
}

TEST(RoughGround, OneWrongScanDoesNotRaiseTheProtectionLevel) {
  // GIVEN scans of which one in ten is wrong in height
  Disturbance d;
  d.match_off = [](double t) {
    const bool wrong = std::fmod(t + 0.05, 1.0) < 0.1;
    return t > 30.0 && wrong ? Vec3(0.0, 0.0, 0.3) : Vec3(Vec3::Zero());
  };
  const double undisturbed_m = drive(30.0, {}).highest_level_up_m;
  // THEN its velocity after that scan, which the next one corrects, is not extrapolated.
  const Seen seen = drive(60.0, d);
  std::printf("vertical level: %.2f m, undisturbed %.2f m\n", seen.highest_level_up_m,
              undisturbed_m);
  EXPECT_LT(seen.highest_level_up_m, 2.0 * undisturbed_m);
}

}  // namespace
}  // namespace rcs::wm

// Wheels with a wrong speed, where the LADAR observes the distance poorly: they are excluded, and
// no other source is; when the fault is over they are readmitted.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/wm/fault_drive.h"

namespace rcs::wm {
namespace {

Disturbance slow_or_fast_wheels(double bias_mps, double end_s) {
  Disturbance d;
  d.match = [](double, RollingMatch* match) { match->information.topLeftCorner<3, 3>() *= 1e-4; };
  d.wheels = [=](double t, OdometrySample* wheels) {
    if (t > 30.0 && t < end_s) wheels->speed_mps += bias_mps;
  };
  return d;
}

bool excluded_another(const Seen& seen) {
  return seen.found(Finding::kGpsFaulty) || seen.found(Finding::kInsFaulty) ||
         seen.found(Finding::kLadarFaulty);
}

TEST(OdometryFault, WithFixesNoOtherSourceIsExcluded) {
  for (const double bias_mps : {-0.6, 0.3, 0.45, 0.6}) {
    const Seen seen = drive(100.0, slow_or_fast_wheels(bias_mps, 60.0));
    std::printf("%.2f m/s: worst %.2f m\n", bias_mps, seen.worst_m);
    EXPECT_FALSE(excluded_another(seen)) << bias_mps;
    EXPECT_LT(seen.worst_m, 2.0) << bias_mps;
    EXPECT_EQ(seen.beyond_protection, 0) << bias_mps;
    const bool excluded = seen.found(Finding::kOdometryFaulty);
    EXPECT_EQ(excluded, seen.found(Finding::kOdometryReadmitted)) << bias_mps;
  }
}

TEST(OdometryFault, WithoutFixesNoOtherSourceIsExcluded) {
  for (const double bias_mps : {-0.6, 0.45, 0.6}) {
    Disturbance d = slow_or_fast_wheels(bias_mps, 60.0);
    d.has_fix = [](double t) { return t < 25.0; };
    const Seen seen = drive(100.0, d);
    std::printf("%.2f m/s: worst %.2f m\n", bias_mps, seen.worst_m);
    EXPECT_FALSE(excluded_another(seen)) << bias_mps;
  }
}

}  // namespace
}  // namespace rcs::wm

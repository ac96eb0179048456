// The non-holonomic constraint tells a slide from a filter that diverges sideways (ADR 55).
#include <gtest/gtest.h>

#include <cmath>

#include "modules/wm/alignment.h"
#include "modules/wm/filter.h"
#include "modules/wm/measurement_fusion.h"

namespace rcs::wm {
namespace {

/// A belief with a known velocity and the lateral constraint: no other measurements.
class LateralConstraint : public testing::Test {
 protected:
  LateralConstraint() {
    s_.belief.x.inertial = true;
    s_.belief.P.diagonal().segment<6>(kVelocity).setConstant(1e-4);
  }
  void hold(double after_s = 0.5) {
    Innovations records;
    s_.belief.x.stamp += from_milliseconds(1000.0 * after_s);
    const Stamp now = s_.belief.x.stamp;
    apply(model_, {now, ImuSample{now, Duration(10'000), Vec3::Zero(), Vec3::Zero()}}, &s_,
          &records);
  }
  Vec3& velocity() { return s_.belief.x.v_world; }  // it faces east
  void pitch(double rad) { s_.belief.x.T_world_vehicle.q = exp_so3(Vec3(0.0, rad, 0.0)); }

  const Model model_{WmParams{}};
  FilterState s_{initial_belief(model_.params, from_utime(1'000'000)), {}};
};

TEST_F(LateralConstraint, AShortSlideIsRejectedAndALateralDivergenceIsDetected) {
  velocity() = Vec3(0.0, 5.0, 0.0);
  for (int k = 0; k < 3; ++k) hold();
  EXPECT_NEAR(velocity().y(), 5.0, 1e-9);
  for (int k = 0; k < 5; ++k) hold();
  EXPECT_LT(std::abs(velocity().y()), 0.5);
  // For 2 s it diverged at 5 m/s, and its sigma covers that.
  EXPECT_GT(std::sqrt(s_.belief.P.diagonal().segment<3>(kPosition).maxCoeff()), 5.0);
}

// Over a gully at speed a body pitches and rolls by 40 deg back and forth; its velocity does not
// follow its heading.
TEST_F(LateralConstraint, APitchingBodyIsNotALateralDivergence) {
  velocity() = Vec3(10.0, 0.0, 0.0);
  for (int k = 0; k < 12; ++k) {
    pitch(k % 2 == 0 ? 0.5 : -0.5);
    hold();
  }
  EXPECT_NEAR(velocity().z(), 0.0, 1e-9);
}

TEST_F(LateralConstraint, ALateralDivergenceIsDetectedWhileTheBodyPitches) {
  velocity() = Vec3(10.0, 2.0, 0.0);
  s_.belief.P.diagonal().segment<3>(kSlip).setConstant(1e-8);
  for (int k = 0; k < 5; ++k) {
    pitch(k % 2 == 0 ? 0.3 : -0.3);
    hold();
  }
  EXPECT_LT(std::abs(velocity().y()), 0.5);
  EXPECT_NEAR(velocity().z(), 0.0, 0.5);
}

TEST_F(LateralConstraint, TwoSlidesFarApartInTimeAreNotADivergence) {
  velocity() = Vec3(10.0, 5.0, 0.0);
  for (int k = 0; k < 4; ++k) hold();
  hold(100.0);
  EXPECT_NEAR(velocity().y(), 5.0, 1e-9);
}

}  // namespace
}  // namespace rcs::wm

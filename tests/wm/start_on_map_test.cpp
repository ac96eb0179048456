// Without GPS frame world begins at the pose that SP's search on the a priori map finds.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include "tests/wm/estimator_rig.h"

namespace rcs::wm {
namespace {

/// Without GPS; the result of SP's search arrives once, 12 s after the start.
Rig& start_on_map(Rig* rig, const Vec3& off_m, double sigma_m, double sigma_rad) {
  auto& [truth, sensors, estimator] = *rig;
  for (std::size_t i = 1; i < truth.size(); ++i) {
    estimator.add(sensors.imu(i));
    if (i % 10 != 0) continue;
    estimator.add(truth[i].stamp, sensors.scan(i));
    if (i == 1200) {
      PriorMatch found;
      found.T_world_vehicle = truth[i].T_world_vehicle;
      found.T_world_vehicle.p += off_m;
      Vec6 sigma;
      sigma << Vec3::Constant(sigma_m), Vec3::Constant(sigma_rad);
      found.information = sigma.cwiseAbs2().cwiseInverse().asDiagonal();
      found.bias = {0.3, 500.0};
      EXPECT_EQ(estimator.add(truth[i].stamp, found), Reason::kAccepted);
    }
    estimator.fuse();
    estimator.clear_innovations();
  }
  return *rig;
}

TEST(StartOnMap, FrameWorldBeginsAtAMatch) {
  Experiment experiment;
  experiment.drive.length_s = 20.0;
  Rig rig(experiment);
  const FilterState& s = start_on_map(&rig, Vec3(0.5, -0.4, 0.2), 0.5, 0.01).estimator.state();
  EXPECT_TRUE(s.bookkeeping.georeferenced);
  EXPECT_EQ(s.bookkeeping.world_resets, 1);
  const Truth& at = rig.truth.back();
  const Vec3 off = s.belief.x.T_world_vehicle.p - at.T_world_vehicle.p;
  EXPECT_LT(off.norm(), 1.5);
  const Mat3 P = s.belief.P.topLeftCorner<3, 3>();
  EXPECT_LT(off.dot(P.ldlt().solve(off)), 11.3);  // 99 %
  // The error is that of the survey there, and the covariance covers it: position and prior-map
  // bias together are known better than each alone.
  const Mat3 O = s.belief.P.block<3, 3>(kMapBias, kMapBias);
  const Mat3 both = P + O + s.belief.P.block<3, 3>(kPosition, kMapBias) +
                    s.belief.P.block<3, 3>(kMapBias, kPosition);
  const double survey_m = PriorMapParams{}.bias_margin * 0.3;
  EXPECT_GT(P.trace(), 3.0 * survey_m * survey_m);
  EXPECT_LT(both.trace(), 0.6 * P.trace());
  EXPECT_GT(Eigen::LDLT<Cov>(Cov(s.belief.P + 1e-12 * Cov::Identity())).vectorD().minCoeff(), 0.0);
}

TEST(StartOnMap, AMatchWithoutHeadingInformationIsRejectedAsAStart) {
  Experiment experiment;
  experiment.drive.length_s = 16.0;
  Rig rig(experiment);
  EXPECT_FALSE(
      start_on_map(&rig, Vec3::Zero(), 0.5, 0.2).estimator.state().bookkeeping.georeferenced);
  Rig other(experiment);
  EXPECT_FALSE(
      start_on_map(&other, Vec3::Zero(), 20.0, 0.01).estimator.state().bookkeeping.georeferenced);
}

}  // namespace
}  // namespace rcs::wm

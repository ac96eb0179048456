#include "modules/wm/fault_detection/match_mean.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace rcs::wm {
namespace {

Mat6 diagonal(double position_m, double angle_rad) {
  Mat6 covariance = Mat6::Zero();
  covariance.diagonal().head<3>().setConstant(position_m * position_m);
  covariance.diagonal().tail<3>().setConstant(angle_rad * angle_rad);
  return covariance;
}

/// Of a scan that observes y + arm_m * heading, and each of the two hardly.
Mat6 coupled(double arm_m) {
  Mat6 information = diagonal(0.05, 0.002).inverse();
  information(1, 1) = 1.0;
  information(5, 5) = 100.0;
  Vec6 combination = Vec6::Zero();
  combination[1] = 1.0;
  combination[5] = arm_m;
  information += combination * combination.transpose() / (0.03 * 0.03);
  return information.inverse();
}

Quat heading(double deg) { return Quat(Eigen::AngleAxisd(radians(deg), Vec3::UnitZ())); }

TEST(MatchMean, OfEqualResidualsIsTheResidual) {
  MatchMean mean;
  Vec6 r;
  r << 0.1, -0.2, 0.3, 0.01, -0.02, 0.03;
  for (int k = 0; k < 12; ++k) mean.add(heading(20.0), r, diagonal(0.05, 0.002));
  EXPECT_EQ(mean.count(), 12);
  EXPECT_LT((mean.mean(heading(20.0)) - r).norm(), 1e-12);
  const Mat6 covariance = mean.covariance(heading(20.0));
  EXPECT_NEAR(std::sqrt(covariance(0, 0)), 0.05 / std::sqrt(10.0), 0.005) << "ten independent ones";
}

TEST(MatchMean, AGrowingDisplacementIsNoRotation) {
  MatchMean mean;
  Quat q = heading(0.0);
  Vec6 r = Vec6::Zero();
  for (int k = 0; k < 30; ++k) {
    r[0] = -8.0 - 0.06 * k;  // a motion by the INS alone that drifts
    r[1] = 0.5 - 0.06 * k;
    r[5] = radians(0.6);
    mean.add(q, r, coupled(k % 2 == 0 ? 20.0 : 14.0));
  }
  EXPECT_NEAR(degrees(mean.mean(q)[5]), 0.6, 1e-6);
  EXPECT_NEAR(mean.mean(q)[1], r[1], 1.0);
}

TEST(MatchMean, ADisplacementKeepsItsDirectionWhileTheVehicleTurns) {
  MatchMean mean;
  const Vec3 in_map(-8.0, 3.0, -0.5);
  Quat q = heading(0.0);
  for (int k = 0; k < 20; ++k) {
    q = heading(4.0 * k);
    Vec6 r = Vec6::Zero();
    r.head<3>() = q.conjugate() * in_map;
    mean.add(q, r, diagonal(0.05, 0.002));
  }
  EXPECT_LT((q * Vec3(mean.mean(q).head<3>()) - in_map).norm(), 1e-9);
  EXPECT_LT(mean.mean(q).tail<3>().norm(), 1e-9);
}

TEST(MatchMean, ItsCovarianceIsThatOfItsErrors) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Vec6 squares = Vec6::Zero();
  Vec6 claimed = Vec6::Zero();
  constexpr int kTrials = 2000;
  for (int trial = 0; trial < kTrials; ++trial) {
    MatchMean mean;
    for (int k = 0; k < 40; ++k) {
      const Mat6 covariance = coupled(k % 2 == 0 ? 20.0 : 14.0);
      Vec6 unit;
      for (int i = 0; i < 6; ++i) unit[i] = normal(random);
      mean.add(heading(9.0 * k), Mat6(covariance.llt().matrixL()) * unit, covariance);
    }
    const Quat q = heading(9.0 * 39);
    squares += mean.mean(q).cwiseAbs2();
    claimed = mean.covariance(q).diagonal();
  }
  for (int i = 0; i < 6; ++i) {
    const double ratio = squares[i] / kTrials / claimed[i];
    EXPECT_GT(ratio, 0.3) << i;
    EXPECT_LT(ratio, 0.8) << i << ": it counts ten scans, the weights are of nineteen";
  }
}

TEST(MatchMean, AScanThatDoesNotObserveAnAxisHardlyCountsThere) {
  MatchMean mean;
  Vec6 r = Vec6::Zero();
  for (int k = 0; k < 20; ++k) {
    const bool blind = k % 2 == 0;
    Mat6 covariance = diagonal(0.05, 0.002);
    if (blind) covariance(0, 0) = 1e4;
    r[0] = blind ? 5.0 : 0.1;
    mean.add(heading(0.0), r, covariance);
  }
  EXPECT_NEAR(mean.mean(heading(0.0))[0], 0.1, 1e-3);
}

}  // namespace
}  // namespace rcs::wm

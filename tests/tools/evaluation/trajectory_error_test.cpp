#include "tools/evaluation/trajectory_error.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

namespace rcs::evaluation {
namespace {

/// A drive that turns and climbs, 1 m a step.
PosePairs perfect_pairs(std::size_t n) {
  PosePairs pairs;
  Pose T;
  for (std::size_t i = 0; i < n; ++i) {
    Vec6 step;
    step << 1.0, 0.0, 0.0, 0.0, 0.01 * std::sin(0.05 * static_cast<double>(i)), 0.02;
    T = T * exp_se3(step);
    pairs.stamps.push_back(from_utime(100'000 * static_cast<std::int64_t>(i)));
    pairs.truth.push_back(T);
    pairs.estimate.push_back(T);
  }
  return pairs;
}

PosePairs moved(PosePairs pairs, const Pose& T_other_world) {
  for (Pose& T : pairs.estimate) T = T_other_world * T;
  return pairs;
}

TEST(TrajectoryError, MovingTheWholeEstimateGivesNoErrorAfterAlignment) {
  Vec6 xi;
  xi << 30.0, -20.0, 5.0, 0.5, -0.8, 2.0;
  const PosePairs pairs = moved(perfect_pairs(200), exp_se3(xi));
  EXPECT_GT(absolute_error(pairs, Pose{}).translation_m.rms, 10.0);
  for (const Alignment alignment : {Alignment::kRigid, Alignment::kFirst}) {
    const AbsoluteError e = absolute_error(pairs, align(pairs, alignment));
    EXPECT_LT(e.translation_m.max, 1e-9);
    EXPECT_LT(e.rotation_rad.max, 1e-9);
  }
}

TEST(TrajectoryError, YawAlignmentUndoesYawAndShiftOnly) {
  const PosePairs level = moved(perfect_pairs(200), Pose{exp_so3(Vec3(0, 0, 2.5)), Vec3(9, 8, 7)});
  EXPECT_LT(absolute_error(level, align(level, Alignment::kYaw)).translation_m.max, 1e-9);

  const PosePairs tilted = moved(perfect_pairs(200), Pose{exp_so3(Vec3(0.1, 0, 0)), Vec3::Zero()});
  EXPECT_GT(absolute_error(tilted, align(tilted, Alignment::kYaw)).translation_m.rms, 1.0);
  EXPECT_LT(absolute_error(tilted, align(tilted, Alignment::kRigid)).translation_m.rms, 1e-9);
}

TEST(TrajectoryError, RigidAlignmentOfAPlanarCourseIsNeverAReflection) {
  PosePairs pairs;
  for (int i = 0; i < 50; ++i) {
    const double a = 0.1 * i;
    pairs.stamps.push_back(from_utime(i));
    pairs.truth.push_back({Quat::Identity(), Vec3(10.0 * std::cos(a), 10.0 * std::sin(a), 0.0)});
    pairs.estimate.push_back(pairs.truth.back());
  }
  EXPECT_NEAR(align(pairs, Alignment::kRigid).rotation().determinant(), 1.0, 1e-12);
}

TEST(TrajectoryError, AScaleErrorOfOnePercentIsARelativeErrorOfOnePercent) {
  PosePairs pairs;
  for (int i = 0; i < 300; ++i) {
    pairs.stamps.push_back(from_utime(i));
    pairs.truth.push_back({Quat::Identity(), Vec3(1.0 * i, 0.0, 0.0)});
    pairs.estimate.push_back({Quat::Identity(), Vec3(1.01 * i, 0.0, 0.0)});
  }
  const RelativeError by_length = relative_error_over_length(pairs, 100.0);
  EXPECT_EQ(by_length.segments, 200U);
  EXPECT_NEAR(by_length.translation_percent, 1.0, 1e-9);
  EXPECT_NEAR(by_length.translation_m, 1.0, 1e-9);
  EXPECT_NEAR(by_length.rotation_rad, 0.0, 1e-12);

  const RelativeError by_frames = relative_error_over_frames(pairs, 10);
  EXPECT_EQ(by_frames.segments, 290U);
  EXPECT_NEAR(by_frames.translation_m, 0.1, 1e-9);
  EXPECT_NEAR(drift_percent(pairs), 1.0, 1e-9);
}

TEST(TrajectoryError, AConstantYawRateErrorIsARotationPerMetre) {
  PosePairs pairs;
  for (int i = 0; i < 100; ++i) {
    pairs.stamps.push_back(from_utime(i));
    pairs.truth.push_back({Quat::Identity(), Vec3(1.0 * i, 0.0, 0.0)});
    pairs.estimate.push_back({exp_so3(Vec3(0.0, 0.0, 0.001 * i)), Vec3(1.0 * i, 0.0, 0.0)});
  }
  EXPECT_NEAR(relative_error_over_length(pairs, 20.0).rotation_rad_per_m, 0.001, 1e-12);
}

TEST(TrajectoryError, RelativeErrorDoesNotDependOnTheFrame) {
  Vec6 xi;
  xi << 30.0, -20.0, 5.0, 0.5, -0.8, 2.0;
  const RelativeError r = relative_error_over_length(moved(perfect_pairs(200), exp_se3(xi)), 100.0);
  EXPECT_GT(r.segments, 0U);
  EXPECT_LT(r.translation_m, 1e-9);
}

TEST(TrajectoryError, SegmentLengthsAreThoseOfKittiWhereTheyFit) {
  EXPECT_EQ(lengths_that_fit(30.0), (std::vector<double>{5, 10, 20}));
  EXPECT_EQ(lengths_that_fit(350.0), (std::vector<double>{100, 200, 300}));
  EXPECT_TRUE(lengths_that_fit(1.0).empty());
}

TEST(TrajectoryError, NeesOfErrorsDrawnFromTheirCovarianceAveragesItsDimension) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  Mat6 A;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) A(i, j) = 0.02 * normal(random) + (i == j ? 0.1 : 0.0);
  }
  const Mat6 P = A * A.transpose();
  const Pose T = exp_se3(Vec6::Constant(0.7));
  double sum = 0.0;
  const int n = 4000;
  for (int k = 0; k < n; ++k) {
    Vec6 w;
    for (int i = 0; i < 6; ++i) w[i] = normal(random);
    const Vec6 xi = A * w;
    sum += nees(pose_error(T, T * exp_se3(xi)), P).value();
  }
  // The mean of n chi-square values of 6 degrees has sigma sqrt(12 / n) = 0.055: 4 sigma.
  EXPECT_NEAR(sum / n, 6.0, 0.22);
}

TEST(TrajectoryError, NeesRejectsAnInvalidCovariance) {
  Mat6 P = Mat6::Identity();
  P(5, 5) = -1.0;
  EXPECT_FALSE(nees(Vec6::Ones(), P).has_value());
}

TEST(Statistics, PercentilesAreNearestRank) {
  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  const tools::Summary s = tools::summarize(values);
  EXPECT_EQ(s.p50, 50.0);
  EXPECT_EQ(s.p99, 99.0);
  EXPECT_EQ(s.max, 100.0);
  EXPECT_EQ(s.mean, 50.5);
  EXPECT_EQ(tools::summarize({}).count, 0U);
}

}  // namespace
}  // namespace rcs::evaluation

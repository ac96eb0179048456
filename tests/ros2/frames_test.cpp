// Covariances in fixed axes, times.

#include "rcs/ros2/frames.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

namespace rcs::ros2 {
namespace {

/// Error of a pose as ROS 2 defines it: of the position, and of a rotation about fixed axes.
Vec6 fixed_axes_error(const Pose& T, const Pose& T_true) {
  Vec6 error;
  error.head<3>() = T_true.p - T.p;
  error.tail<3>() = log_so3((T_true.q * T.q.conjugate()).normalized());
  return error;
}

TEST(FixedAxesCovariance, EqualsThatOfANumericalRotation) {
  // A vehicle that is rolled, pitched and turned, with a covariance that is full and anisotropic.
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 20; ++trial) {
    const Pose T = {exp_so3({normal(random), normal(random), normal(random)}),
                    {normal(random), normal(random), normal(random)}};
    Mat6 root;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) root(i, j) = normal(random) * (i < 3 ? 1.0 : 0.1);
    }
    const Mat6 cov = root * root.transpose();
    // The Jacobian of the error of ROS 2 with respect to our perturbation, by finite differences.
    Mat6 jacobian;
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; ++k) {
      Vec6 xi = Vec6::Zero();
      xi[k] = kStep;
      jacobian.col(k) =
          (fixed_axes_error(T, T * exp_se3(xi)) - fixed_axes_error(T, T * exp_se3(-xi))) /
          (2.0 * kStep);
    }
    const Mat6 expected = jacobian * cov * jacobian.transpose();
    const std::array<double, 36> got = fixed_axes_covariance(T, cov);
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        EXPECT_NEAR(got[static_cast<std::size_t>(6 * i + j)], expected(i, j),
                    1e-8 * (1.0 + cov.norm()))
            << i << " " << j;
      }
    }
  }
}

TEST(FixedAxesCovariance, OfAVehicleThatHeadsNorth) {
  // Along-track uncertainty of a vehicle whose x axis points along y of the map.
  const Pose T = {exp_so3({0.0, 0.0, kPi / 2.0}), Vec3::Zero()};
  Mat6 cov = Mat6::Zero();
  cov(0, 0) = 4.0;   // along x of the vehicle
  cov(3, 3) = 0.25;  // roll
  const std::array<double, 36> got = fixed_axes_covariance(T, cov);
  EXPECT_NEAR(got[0], 0.0, 1e-12);
  EXPECT_NEAR(got[7], 4.0, 1e-12) << "y of the map";
  EXPECT_NEAR(got[28], 0.25, 1e-12) << "rotation about y of the map";
}

TEST(Time, IsLimitedToItsRange) {
  const msg::Time t = to_time(1'395'837'296'789'123);
  EXPECT_EQ(t.sec, 1'395'837'296);
  EXPECT_EQ(t.nanosec, 789'123'000U);
  EXPECT_EQ(to_time(-1).sec, 0);
  EXPECT_EQ(to_time(-1).nanosec, 0U);
  EXPECT_EQ(to_time(std::numeric_limits<std::int64_t>::max()).sec,
            std::numeric_limits<std::int32_t>::max());
  EXPECT_EQ(shifted(std::numeric_limits<std::int64_t>::max(), 1),
            std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(shifted(std::numeric_limits<std::int64_t>::min(), -1),
            std::numeric_limits<std::int64_t>::min());
  EXPECT_EQ(shifted(5, -7), -2);
}

}  // namespace
}  // namespace rcs::ros2

#include "tools/base/trajectory.h"

#include <gtest/gtest.h>

#include <random>

namespace rcs::tools {
namespace {

Trajectory wavy_trajectory(std::size_t n) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal(0.0, 1.0);
  Trajectory trajectory;
  Pose T;
  for (std::size_t i = 0; i < n; ++i) {
    Vec6 step;
    step << 1.0, 0.1 * normal(random), 0.05 * normal(random), 0.02 * normal(random),
        0.02 * normal(random), 0.05 * normal(random);
    T = T * exp_se3(step);
    trajectory.push_back(
        {from_utime(1'317'042'272'000'123 + 103'600 * static_cast<std::int64_t>(i)), T});
  }
  return trajectory;
}

TEST(Trajectory, AnInvalidStampIsAnErrorWithItsLine) {
  for (const char* stamp : {"1e32", "-1e32", "1e13", "1e300"}) {
    const Result<Trajectory> t =
        parse_tum("1.5 0 0 0 0 0 0 1\n" + std::string(stamp) + " 0 0 0 0 0 0 1\n", "a.tum");
    ASSERT_FALSE(t) << stamp;
    EXPECT_EQ(t.error().message.substr(0, 8), "a.tum:2:") << t.error().message;
    EXPECT_NE(t.error().message.find("is not a time"), std::string::npos) << t.error().message;
  }
}

TEST(Trajectory, KittiRoundTripKeepsThePoses) {
  const Trajectory out = wavy_trajectory(50);
  const Result<std::vector<Pose>> in = parse_kitti(format_kitti(out), "memory");
  ASSERT_TRUE(in.ok()) << in.error().message;
  ASSERT_EQ(in->size(), out.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    // Ten digits of entries near 1, and of positions below 100 m.
    EXPECT_LT(log_se3(out[i].T.inverse() * (*in)[i]).norm(), 1e-7);
  }
}

TEST(Trajectory, TumRoundTripKeepsStampsToTheMicrosecond) {
  const Trajectory out = wavy_trajectory(50);
  const Result<Trajectory> in = parse_tum(format_tum(out), "memory");
  ASSERT_TRUE(in.ok()) << in.error().message;
  ASSERT_EQ(in->size(), out.size());
  for (std::size_t i = 0; i < out.size(); ++i) {
    EXPECT_EQ((*in)[i].stamp, out[i].stamp);
    EXPECT_LT(log_se3(out[i].T.inverse() * (*in)[i].T).norm(), 1e-7);
  }
}

TEST(Trajectory, BadRowsAreNamedByLine) {
  const Result<std::vector<Pose>> short_row = parse_kitti("# truth\n1 0 0 0 0 1 0 0\n", "t.txt");
  ASSERT_FALSE(short_row.ok());
  EXPECT_EQ(short_row.error().message, "t.txt:2: expected 12 finite numbers, found 8");

  const Result<std::vector<Pose>> scaled = parse_kitti("2 0 0 0 0 2 0 0 0 0 2 0\n", "t.txt");
  ASSERT_FALSE(scaled.ok());
  EXPECT_EQ(scaled.error().message, "t.txt:1: the 3x3 part is not a rotation");

  EXPECT_FALSE(parse_kitti("1 0 0 nan 0 1 0 0 0 0 1 0\n", "t.txt").ok());
  EXPECT_FALSE(parse_tum("1 0 0 0 0 0 0 0\n", "t.txt").ok());
  EXPECT_FALSE(parse_tum("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "t.txt").ok());
}

TEST(Trajectory, PoseBetweenSamplesLiesOnTheScrewMotion) {
  Vec6 twist;
  twist << 2.0, 0.0, 0.1, 0.0, 0.1, 0.4;
  const Trajectory trajectory = {{from_utime(0), Pose{}}, {from_utime(100'000), exp_se3(twist)}};
  const std::optional<Pose> T = pose_at(trajectory, from_utime(25'000), from_milliseconds(200.0));
  ASSERT_TRUE(T.has_value());
  EXPECT_LT(log_se3(T->inverse() * exp_se3(0.25 * twist)).norm(), 1e-12);
}

TEST(Trajectory, NoPoseOutsideNorInALongGap) {
  const Trajectory trajectory = {{from_utime(0), Pose{}}, {from_utime(100'000), Pose{}}};
  const Duration long_enough = from_milliseconds(200.0);
  EXPECT_FALSE(pose_at(trajectory, from_utime(-1), long_enough).has_value());
  EXPECT_FALSE(pose_at(trajectory, from_utime(100'001), long_enough).has_value());
  EXPECT_TRUE(pose_at(trajectory, from_utime(100'000), from_milliseconds(50.0)).has_value());
  EXPECT_FALSE(pose_at(trajectory, from_utime(50'000), from_milliseconds(50.0)).has_value());
}

}  // namespace
}  // namespace rcs::tools

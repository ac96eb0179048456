// Without INS: wheels that contradict the LADAR and one other source are wrong.
#include "modules/wm/fault_detection/wheels_vote.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rcs::wm {
namespace {

/// What a source measures in a bend of 0.1 rad/s at 8 m/s.
struct Off {
  double speed_mps = 0.0;
  double turn_radps = 0.0;
};

struct Received {
  bool fixes = true, velocities = true, ins = true;
};

WheelsVote drive(const Off& wheels, const Off& ladar, const Received& received,
                 double length_s = 10.0, int every = 2) {
  constexpr double kSpeed_mps = 8.0, kTurn_radps = 0.1;
  const auto pose = [](double t, const Off& off) {
    const double radps = kTurn_radps + off.turn_radps;
    const double radius_m = (kSpeed_mps + off.speed_mps) / radps;
    const double a = radps * t;
    return Pose{Quat(Eigen::AngleAxisd(a, Vec3::UnitZ())),
                radius_m * Vec3(std::sin(a), 1.0 - std::cos(a), 0.0)};
  };
  WheelsVote vote;
  for (int k = 0; 0.05 * k < length_s; ++k) {
    const double t = 0.05 * k;
    const Stamp stamp = from_utime(1'000'000) + from_seconds(t);
    OdometrySample sample;
    sample.speed_mps = kSpeed_mps + wheels.speed_mps;
    sample.yaw_rate_radps = kTurn_radps + wheels.turn_radps;
    vote.add(stamp, sample, 1.0);
    const Pose truth = pose(t, {});
    if (k % 4 == 0 && received.fixes) {
      GpsFix fix;
      fix.p_world = truth.p;
      fix.has_velocity = received.velocities;
      if (received.velocities) fix.v_world = truth.q * Vec3(kSpeed_mps, 0.0, 0.0);
      vote.add(stamp, fix);
    }
    if (k % every != 0) continue;
    RollingMatch match;
    match.T_rolling_vehicle = pose(t, ladar);
    const Quat by_ins = truth.q;
    vote.add(stamp, match, received.ins ? &by_ins : nullptr);
  }
  return vote;
}

constexpr Received kFixes{true, true, false}, kPositions{true, false, false},
    kIns{false, false, true}, kNobody{false, false, false};

TEST(WheelsVote, TwoThatAgreeContradictWrongWheels) {
  for (const Received& received : {kFixes, kPositions}) {
    EXPECT_TRUE(drive({0.0, 0.1}, {}, received).contradicts());
    EXPECT_TRUE(drive({-1.5, 0.0}, {}, received).contradicts());
    EXPECT_TRUE(drive({-1.5, 0.0}, {}, received).by_fixes());
  }
  EXPECT_TRUE(drive({0.0, -0.06}, {}, kIns).contradicts());
  EXPECT_FALSE(drive({0.0, -0.06}, {}, kIns).by_fixes());
  EXPECT_NEAR(drive({1.0, -0.06}, {}, kIns).apart().turn_rad, -0.12, 0.01);
  EXPECT_NEAR(drive({1.0, -0.06}, {}, kIns).apart().distance_m, 2.0, 0.1);
}

TEST(WheelsVote, ManyScansASecondCoverTheWindow) {
  EXPECT_TRUE(drive({0.0, 0.1}, {}, kFixes, 10.0, 1).contradicts()) << "20 scans a second";
}

TEST(WheelsVote, BeforeTheFirstComparisonNothingIsKnownOfTheTurn) {
  EXPECT_TRUE(WheelsVote().turn_alike(from_utime(1'000'000)));
}

TEST(WheelsVote, OneAgainstOneDecidesNothing) {
  EXPECT_FALSE(drive({0.0, 0.1}, {}, kNobody).contradicts());
  EXPECT_FALSE(drive({-1.5, 0.0}, {}, kIns).contradicts()) << "an INS measures no distance here";
}

TEST(WheelsVote, AWrongLadarDoesNotContradictTheWheels) {
  EXPECT_FALSE(drive({}, {0.0, 0.15}, {}).contradicts());
  EXPECT_FALSE(drive({}, {2.0, 0.0}, {}).contradicts());
  EXPECT_FALSE(drive({}, {}, {}).contradicts());
}

TEST(WheelsVote, WithoutScansForLongNothingIsKnownOfTheTurn) {
  const WheelsVote vote = drive({0.0, 0.1}, {}, kNobody);
  const Stamp end = from_utime(1'000'000) + from_seconds(10.0);
  EXPECT_FALSE(vote.turn_alike(end));
  EXPECT_TRUE(vote.turn_alike(end + from_seconds(10.0)));
  EXPECT_TRUE(drive({}, {}, kNobody).turn_alike(end));
}

}  // namespace
}  // namespace rcs::wm

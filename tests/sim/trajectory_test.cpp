#include "sim/vehicle/trajectory.h"

#include <gtest/gtest.h>

#include <random>

namespace rcs::sim {
namespace {

Trajectory wild_motion() {
  std::mt19937 rng(11);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::vector<Pose> knots(1);
  for (int k = 0; k < 60; ++k) {
    Vec6 step;
    for (int i = 0; i < 6; ++i) step[i] = 0.05 * normal(rng);
    step[0] += 0.2;
    knots.push_back(knots.back() * exp_se3(step));
  }
  return Trajectory(std::move(knots), 0.02);
}

TEST(Trajectory, DerivativesMatchThePose) {
  const Trajectory t = wild_motion();
  const double h = 1e-5;
  for (int k = 0; k < 110; ++k) {
    const double s = 0.005 + 0.01 * k;  // never at a knot, where the jerk steps
    const Motion m = t.at(s);
    const Motion before = t.at(s - h);
    const Motion after = t.at(s + h);
    const Vec3 v = (after.T_world_vehicle.p - before.T_world_vehicle.p) / (2 * h);
    const Vec3 a = (after.v_world - before.v_world) / (2 * h);
    const Vec3 w =
        log_so3(before.T_world_vehicle.q.conjugate() * after.T_world_vehicle.q) / (2 * h);
    EXPECT_LT((m.v_world - v).norm(), 1e-4) << s;
    EXPECT_LT((m.a_world - a).norm(), 1e-4) << s;
    EXPECT_LT((m.rate_vehicle - w).norm(), 1e-3) << s;
  }
}

TEST(Trajectory, GrowingKnotByKnotEqualsTheWhole) {
  std::vector<Pose> knots(1);
  for (int k = 0; k < 300; ++k) {
    knots.push_back(knots.back() *
                    exp_se3((Vec6() << 0.2, 0.01, 0, 0, 0, 0.01 * (k % 7)).finished()));
  }
  const Trajectory whole(knots, 0.02);
  Trajectory grown({knots.begin(), knots.begin() + 4}, 0.02);
  for (std::size_t k = 4; k < knots.size(); ++k) {
    const double s = grown.duration_s();
    EXPECT_LT(log_se3(grown.pose_at(s).inverse() * whole.pose_at(s)).norm(), 1e-12);
    grown.append(knots[k]);
    grown.forget_before(s - 0.5);
    const Motion a = grown.at(s - 0.3);
    const Motion b = whole.at(s - 0.3);
    EXPECT_EQ(a.T_world_vehicle.p, b.T_world_vehicle.p);
    EXPECT_EQ(a.v_world, b.v_world);
    EXPECT_EQ(a.rate_vehicle, b.rate_vehicle);
  }
  EXPECT_EQ(grown.duration_s(), whole.duration_s());
  EXPECT_LT(grown.knots_kept(), 70U);
}

TEST(Trajectory, PoseAtEqualsThePoseOfAt) {
  const Trajectory t = wild_motion();
  for (double s = -0.1; s < t.duration_s() + 0.1; s += 0.013) {
    EXPECT_LT(log_se3(t.pose_at(s).inverse() * t.at(s).T_world_vehicle).norm(), 1e-12);
  }
}

TEST(Trajectory, IsContinuousAcrossKnots) {
  const Trajectory t = wild_motion();
  for (int k = 1; k < 57; ++k) {
    const Motion a = t.at(0.02 * k - 1e-9);
    const Motion b = t.at(0.02 * k + 1e-9);
    EXPECT_LT((a.T_world_vehicle.p - b.T_world_vehicle.p).norm(), 1e-6);
    EXPECT_LT((a.v_world - b.v_world).norm(), 1e-5);
    EXPECT_LT((a.a_world - b.a_world).norm(), 1e-3);
    EXPECT_LT((a.rate_vehicle - b.rate_vehicle).norm(), 1e-5);
  }
}

}  // namespace
}  // namespace rcs::sim

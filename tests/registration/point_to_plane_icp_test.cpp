#include "modules/registration/point_to_plane_icp.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include <limits>
#include <random>

#include "tests/support/point_scenes.h"

namespace rcs::registration {
namespace {

using test::Ground;

constexpr WorkUnits kPlenty = 1'000'000'000;

struct Fixture {
  Fixture(Ground ground, bool walls) : map(RollingMapParams{}), rng(11) {
    map.insert(test::scene(ground, walls, 60'000, 0.01, Vec3::Zero(), &rng), Pose{});
    source =
        test::moved(T_true.inverse(), test::scene(ground, walls, 3000, 0.02, Vec3::Zero(), &rng));
  }
  Registration run(const Prediction& prediction, WorkUnits granted = kPlenty) {
    return register_points(source, &map, prediction, params, granted, &workspace);
  }
  RollingMap map;
  std::mt19937 rng;
  Pose T_true = test::pose(1.0, -0.5, 0.8, 0.02, -0.03, 0.4);
  Points source;
  IcpParams params;
  IcpWorkspace workspace;
};

Vec6 error(const Registration& r, const Pose& T) {
  return log_se3(T.inverse() * r.T_target_vehicle);
}

TEST(Icp, FindsThePose) {
  Fixture f(Ground::kRolling, true);
  const Pose start = f.T_true * test::pose(0.3, -0.2, 0.1, 0.01, 0.01, 0.03);
  const Registration r = f.run(test::prediction(start, 0.5, 0.05));
  ASSERT_EQ(r.stop, Stop::kConverged);
  // 3000 points of 2 cm against 1 cm surfaces: the achievable accuracy is one or two millimetres.
  EXPECT_LT(error(r, f.T_true).head<3>().norm(), 0.004);
  EXPECT_LT(error(r, f.T_true).tail<3>().norm(), 0.0005);
  EXPECT_GT(r.overlap, 0.8);
  EXPECT_NEAR(r.correction_m, 0.37, 0.05);
}

TEST(Icp, MovingTheSourceMovesTheResult) {
  Fixture f(Ground::kRolling, true);
  const Registration before = f.run(test::prediction(f.T_true, 0.5, 0.05));
  const Pose T = test::pose(2.0, 1.0, -0.3, 0.1, 0.05, -0.7);
  f.source = test::moved(T, f.source);
  const Registration after = f.run(test::prediction(f.T_true * T.inverse(), 0.5, 0.05));
  const Pose expected = before.T_target_vehicle * T.inverse();
  EXPECT_LT(error(after, expected).head<3>().norm(), 2e-3);
  EXPECT_LT(error(after, expected).tail<3>().norm(), 2e-4);
}

TEST(Icp, InformationDoesNotContainThePrior) {
  // The prior's sigma x 10 changes pose and information by less than 5 % of a sigma, and a prior
  // shifted by 2 sigma does not shift the result.
  Fixture f(Ground::kRolling, true);
  const Registration base = f.run(test::prediction(f.T_true, 0.05, 0.005));
  ASSERT_EQ(base.stop, Stop::kConverged);
  const Vec6 sigma = base.information.inverse().diagonal().cwiseSqrt();

  const Registration wide = f.run(test::prediction(f.T_true, 0.5, 0.05));
  EXPECT_LT(error(wide, base.T_target_vehicle).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 0.05);
  const Vec6 wide_sigma = wide.information.inverse().diagonal().cwiseSqrt();
  EXPECT_LT((wide_sigma.cwiseQuotient(sigma) - Vec6::Ones()).cwiseAbs().maxCoeff(), 0.05);

  const Pose shifted = f.T_true * test::pose(0.1, -0.1, 0.1, 0.01, -0.01, 0.01);
  const Registration moved = f.run(test::prediction(shifted, 0.05, 0.005));
  EXPECT_LT(error(moved, base.T_target_vehicle).cwiseQuotient(sigma).cwiseAbs().maxCoeff(), 0.05);
}

TEST(Icp, FlatFieldLeavesThreeDirectionsToThePrediction) {
  Fixture f(Ground::kFlat, false);
  const Pose start = f.T_true * test::pose(0.2, 0.1, 0.1, 0.01, 0.0, 0.02);
  const Registration r = f.run(test::prediction(start, 0.5, 0.05));
  ASSERT_EQ(r.stop, Stop::kDegenerate);
  const Eigen::SelfAdjointEigenSolver<Mat6> eigen(r.information);
  EXPECT_LT(eigen.eigenvalues()[2],
            1e-6 * eigen.eigenvalues()[3]);  // no information about x, y and yaw
  EXPECT_GT(eigen.eigenvalues()[3], 1.0);
  // Height, roll and pitch are determined; along the plane the result is the prediction.
  const Vec3 p_plane(r.T_target_vehicle.p.x(), r.T_target_vehicle.p.y(), 0.0);
  EXPECT_NEAR(r.T_target_vehicle.p.z(), f.T_true.p.z(), 0.004);
  EXPECT_LT((p_plane - Vec3(start.p.x(), start.p.y(), 0.0)).norm(), 0.02);
}

TEST(Icp, CorridorLeavesItsLengthToThePrediction) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  const auto corridor = [&](int n) {
    Points points;
    for (int i = 0; i < n; ++i) {
      const double side = i % 2 == 0 ? 2.0 : -2.0;
      const Vec3 p = i % 3 == 0 ? Vec3(20.0 * u(rng), 2.0 * u(rng), 0.0)
                                : Vec3(20.0 * u(rng), side, 1.5 + 1.5 * u(rng));
      points.push_back(p.cast<float>());
    }
    return points;
  };
  RollingMap map{RollingMapParams{}};
  map.insert(corridor(60'000), Pose{});
  IcpWorkspace workspace;
  const Registration r = register_points(
      corridor(3000), &map, test::prediction(Pose{Quat::Identity(), Vec3(0.3, 0.1, 0)}, 0.5, 0.05),
      IcpParams{}, kPlenty, &workspace);
  ASSERT_EQ(r.stop, Stop::kDegenerate);
  EXPECT_LT(r.information(0, 0), 1e-6 * r.information(1, 1));
  EXPECT_NEAR(r.T_target_vehicle.p.x(), 0.3, 0.01);
  EXPECT_NEAR(r.T_target_vehicle.p.y(), 0.0, 0.002);
}

TEST(Icp, StopsAtItsGrantAndReportsIt) {
  Fixture f(Ground::kRolling, true);
  // The first iterations use a fifth of the points.
  const auto n = static_cast<WorkUnits>(f.source.size() / 5);
  const Registration r = f.run(test::prediction(f.T_true, 0.5, 0.05), 3 * n + n / 2);
  EXPECT_EQ(r.stop, Stop::kBudget);
  EXPECT_EQ(r.iterations, 3);
  EXPECT_EQ(r.used, 3 * n);
  EXPECT_LT(error(r, f.T_true).head<3>().norm(), 0.1);
  const Registration whole = f.run(test::prediction(f.T_true, 0.5, 0.05), kPlenty);
  EXPECT_LT(r.information.trace(), 0.8 * whole.information.trace()) << "the information is smaller";
  const Registration nothing = f.run(test::prediction(f.T_true, 0.5, 0.05), n - 1);
  EXPECT_EQ(nothing.stop, Stop::kBudget);
  EXPECT_EQ(nothing.information, Mat6(Mat6::Zero()));
}

TEST(Icp, EmptyAndDegenerateInputsGetAResult) {
  Fixture f(Ground::kRolling, true);
  f.source.clear();
  EXPECT_EQ(f.run(test::prediction(f.T_true, 0.5, 0.05)).stop, Stop::kEmpty);
  f.source.push_back(Vec3f(1, 2, 3));
  EXPECT_EQ(f.run(test::prediction(f.T_true, 0.5, 0.05)).stop, Stop::kTooFew);
  Fixture g(Ground::kRolling, true);
  const Pose far = test::pose(500.0, 0.0, 0.0, 0.0, 0.0, 0.0);
  const Registration r = g.run(test::prediction(far, 0.5, 0.05));
  EXPECT_EQ(r.stop, Stop::kTooFew);
  EXPECT_EQ(r.information, Mat6(Mat6::Zero()));
  RollingMap empty{RollingMapParams{}};
  EXPECT_EQ(register_points(g.source, &empty, test::prediction(Pose{}, 1, 1), g.params, kPlenty,
                            &g.workspace)
                .stop,
            Stop::kEmpty);
}

TEST(Icp, TheSameInputGivesTheSameBits) {
  Fixture a(Ground::kRolling, true);
  Fixture b(Ground::kRolling, true);
  const Registration ra = a.run(test::prediction(a.T_true, 0.5, 0.05));
  const Registration rb = b.run(test::prediction(b.T_true, 0.5, 0.05));
  EXPECT_EQ(ra.T_target_vehicle.p, rb.T_target_vehicle.p);
  EXPECT_EQ(ra.information, rb.information);
}

TEST(Icp, ErrorsAreConsistentWithTheCovariance) {
  // Mean normalized error squared over seeds, per degree of freedom; noise as the model assumes.
  double nees = 0.0;
  constexpr int kRuns = 40;
  for (int seed = 0; seed < kRuns; ++seed) {
    std::mt19937 rng(static_cast<unsigned>(100 + seed));
    RollingMap map{RollingMapParams{}};
    map.insert(test::scene(Ground::kRolling, true, 60'000, 0.03, Vec3::Zero(), &rng), Pose{});
    const Points source = test::scene(Ground::kRolling, true, 3000, 0.03, Vec3::Zero(), &rng);
    IcpWorkspace workspace;
    const Registration r = register_points(source, &map, test::prediction(Pose{}, 0.2, 0.02),
                                           IcpParams{}, kPlenty, &workspace);
    const Vec6 e = error(r, Pose{});
    nees += e.dot(r.information * e) / 6.0 / kRuns;
  }
  // Here the residuals of a surface are uncorrelated, although the model allows for correlation:
  // the result may be conservative, never overconfident.
  EXPECT_LT(nees, 1.5);
  EXPECT_GT(nees, 0.05);
}

TEST(Registration, ADistortionAddsItsCovariance) {
  Vec6 information;
  information << 1e4, 400.0, 25.0, 1e6, 1e4, 0.0;
  Vec6 distortion;
  distortion << 0.04, 0.04, 0.04, 1e-4, 1e-4, 1e-4;
  const Mat6 out = with_distortion(information.asDiagonal(), distortion.asDiagonal());
  for (int i = 0; i < 5; ++i) {
    EXPECT_NEAR(out(i, i), 1.0 / (1.0 / information[i] + distortion[i]), 1e-6 * out(i, i)) << i;
  }
  EXPECT_NEAR(out(5, 5), 0.0, 1e-9);  // an unobserved direction stays unobserved
  EXPECT_TRUE(out.isApprox(out.transpose()));
}

}  // namespace
}  // namespace rcs::registration

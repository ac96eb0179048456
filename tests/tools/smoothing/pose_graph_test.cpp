// The drive as a least-squares problem: derivatives, known solutions, false matches, covariances.

#include "tools/smoothing/pose_graph.h"

#include <gtest/gtest.h>
#include <cstdint>

#include <Eigen/Dense>
#include <random>

#include "tools/smoothing/graph_solver.h"
#include "tools/smoothing/selected_inverse.h"

namespace rcs::smoothing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

bool never() { return false; }

Vec3 random3(std::mt19937* random, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  const double x = normal(*random);
  const double y = normal(*random);
  return {x, y, normal(*random)};
}

Pose random_pose(std::mt19937* random, double sigma_m, double sigma_rad) {
  Vec6 xi;
  xi.head<3>() = random3(random, sigma_m);
  xi.tail<3>() = random3(random, sigma_rad);
  return exp_se3(xi);
}

/// Three nodes with all quantities different from zero.
struct Scene {
  PoseGraph graph;
  GraphState state;
};

Scene make_scene() {
  std::mt19937 random(7);
  Scene s;
  s.graph.earth_rate_world = Vec3(0.0, 5e-2, 4e-2);  // far too fast, so that its effect is visible
  s.graph.p_vehicle_antenna = Vec3(-0.5, 0.2, 1.1);
  for (int k = 0; k < 3; ++k) {
    s.state.T_world_vehicle.push_back(random_pose(&random, 3.0, 0.5));
    s.state.v_world.push_back(random3(&random, 5.0));
    s.state.gyro_bias.push_back(random3(&random, 0.01));
    s.state.accel_bias.push_back(random3(&random, 0.1));
    s.state.gps_bias.push_back(random3(&random, 1.0));
    Vec6 twist;
    twist << random3(&random, 5.0), random3(&random, 0.3);
    s.graph.twist.push_back(twist);
  }
  s.state.shared.mount = random_pose(&random, 0.05, 0.05);
  s.state.shared.ladar_delay_s = 0.02;
  s.state.shared.gyro_scale = random3(&random, 0.01);
  s.state.shared.accel_gain << 1e-3, 2e-3, -1e-3, 0.0, 1e-3, 5e-4, 2e-3, 0.0, 1e-3;
  s.state.shared.wheel_scale = 0.01;
  s.state.shared.climb_slip = 0.1;
  return s;
}

Preintegrated make_motion() {
  std::vector<InertialIncrement> samples;
  for (int k = 1; k <= 20; ++k) {
    samples.push_back({from_utime(std::int64_t{k} * 10'000), 0.01, Vec3(0.002, -0.003, 0.006),
                       Vec3(0.01, 0.02 + 0.001 * k, 0.1)});
  }
  return preintegrate(samples, from_utime(0), from_utime(200'000), {}, {1e-2, 1e-1});
}

/// The columns of the derivatives equal numerical differences, to a share of the largest.
template <class Linearize>
void expect_jacobian(const Scene& scene, const Linearize& linearize_here, double tolerance) {
  const LinearEdge at = linearize_here(scene.state);
  const int size = Columns(scene.state).size();
  MatrixXd analytic = MatrixXd::Zero(at.r.size(), size);
  for (const LinearEdge::Block& b : at.blocks) {
    analytic.middleCols(b.column, b.J.cols()) += b.J;
  }
  MatrixXd numeric(at.r.size(), size);
  constexpr double kStep = 1e-6;
  for (int k = 0; k < size; ++k) {
    VectorXd dx = VectorXd::Zero(size);
    dx[k] = kStep;
    const VectorXd plus = linearize_here(moved(scene.state, dx)).r;
    const VectorXd minus = linearize_here(moved(scene.state, -dx)).r;
    numeric.col(k) = (plus - minus) / (2.0 * kStep);
  }
  const double scale = numeric.cwiseAbs().maxCoeff();
  EXPECT_GT(scale, 0.0);
  EXPECT_LT((numeric - analytic).cwiseAbs().maxCoeff(), tolerance * scale);
}

TEST(PoseGraph, InertialJacobianMatchesNumericalDifferences) {
  const Scene s = make_scene();
  InertialEdge e{0, 1, 1, make_motion()};
  expect_jacobian(
      s, [&](const GraphState& x) { return linearize(s.graph, x, e); }, 1e-5);
}

TEST(PoseGraph, GpsJacobiansMatchNumericalDifferences) {
  const Scene s = make_scene();
  GpsEdge e;
  e.node = 1;
  e.stretch = 2;
  e.T_node_vehicle = exp_se3((Vec6() << 1.0, 0.2, 0.1, 0.02, 0.01, 0.2).finished());
  e.dv_node = Vec3(0.5, 0.1, -0.2);
  e.has_velocity = true;
  e.rate_radps = Vec3(0.1, 0.2, 0.4);
  e.sigma_m = Vec3(0.5, 1.0, 2.0);
  expect_jacobian(
      s, [&](const GraphState& x) { return linearize_position(s.graph, x, e); }, 1e-6);
  expect_jacobian(
      s, [&](const GraphState& x) { return linearize_velocity(s.graph, x, e); }, 1e-6);
}

TEST(PoseGraph, WheelJacobianMatchesNumericalDifferences) {
  const Scene s = make_scene();
  const WheelEdge e{2, Vec3(0.98, 0.1, 0.02), 0.3, 5.0, 0.05};
  expect_jacobian(
      s, [&](const GraphState& x) { return linearize(s.graph, x, e); }, 1e-6);
}

TEST(PoseGraph, MotionAndMatchJacobiansMatchNumericalDifferencesAtASmallResidual) {
  const Scene s = make_scene();
  const MotionEdge motion{0, 2, s.state.T_world_vehicle[0].inverse() * s.state.T_world_vehicle[2],
                          Vec6::Constant(0.1)};
  expect_jacobian(
      s, [&](const GraphState& x) { return linearize(s.graph, x, motion); }, 1e-5);
  MatchEdge match;
  match.map = 2;
  match.scan = 0;
  match.information = Vec6::Constant(4.0).asDiagonal();
  match.T_map_scan = seen_pose(s.graph, s.state, 2).inverse() * seen_pose(s.graph, s.state, 0);
  expect_jacobian(
      s, [&](const GraphState& x) { return linearize(s.graph, x, match); }, 1e-5);
}

/// A square of `side` nodes a side, a metre apart, driven twice; every motion has the error `bias`.
struct Square {
  PoseGraph graph;
  GraphState start;
  std::vector<Pose> truth;
};

Square make_square(int side, const Vec6& bias, std::mt19937* random) {
  Square s;
  Pose T;
  const int nodes = 2 * 4 * side;
  for (int k = 0; k < nodes; ++k) {
    s.truth.push_back(T);
    T = T * Pose{Quat::Identity(), Vec3(1.0, 0.0, 0.0)};
    if ((k + 1) % side == 0) T = T * Pose{exp_so3(Vec3(0, 0, 0.5 * kPi)), Vec3::Zero()};
  }
  s.graph.twist.assign(s.truth.size(), Vec6::Zero());
  s.start.T_world_vehicle.push_back(s.truth[0]);
  for (std::size_t k = 0; k + 1 < s.truth.size(); ++k) {
    Vec6 off = bias;
    if (random != nullptr) {
      off.head<3>() += random3(random, 0.02);
      off.tail<3>() += random3(random, 0.002);
    }
    MotionEdge e;
    e.from = k;
    e.to = k + 1;
    e.T_from_to = s.truth[k].inverse() * s.truth[k + 1] * exp_se3(off);
    e.sigma << Vec3::Constant(0.02), Vec3::Constant(0.002);
    s.graph.motion.push_back(e);
    s.start.T_world_vehicle.push_back(s.start.T_world_vehicle.back() * e.T_from_to);
  }
  s.start.v_world.assign(s.truth.size(), Vec3::Zero());
  s.start.gyro_bias.assign(1, Vec3::Zero());
  s.start.accel_bias.assign(1, Vec3::Zero());
  s.graph.priors.first_pose = s.truth[0];
  return s;
}

void add_revisits(int side, Square* s) {
  const std::size_t lap = static_cast<std::size_t>(4 * side);
  for (std::size_t k = 0; k < lap; k += 2) {
    MatchEdge e;
    e.map = k;
    e.scan = k + lap;
    e.revisit = true;
    e.T_map_scan = s->truth[k].inverse() * s->truth[k + lap];
    e.information.diagonal() << Vec3::Constant(1e4), Vec3::Constant(1e6);
    s->graph.matches.push_back(e);
  }
}

double worst_m(const GraphState& state, const std::vector<Pose>& truth) {
  double worst = 0.0;
  for (std::size_t k = 0; k < truth.size(); ++k) {
    worst = std::max(worst, (state.T_world_vehicle[k].p - truth[k].p).norm());
  }
  return worst;
}

TEST(GraphSolver, ExactMeasurementsGiveTheExactSquareFromAWrongStart) {
  Square s = make_square(10, Vec6::Zero(), nullptr);
  add_revisits(10, &s);
  std::mt19937 random(3);
  for (Pose& T : s.start.T_world_vehicle) T = T * random_pose(&random, 0.2, 0.02);
  const SolvedGraph solved = solve(s.graph, s.start, {}, never);
  EXPECT_TRUE(solved.converged);
  EXPECT_FALSE(solved.singular);
  EXPECT_LT(worst_m(solved.state, s.truth), 1e-5);
}

TEST(GraphSolver, RevisitsRemoveDrift) {
  // 0.2 degrees a metre: each lap of 40 m turns by 8 degrees too much.
  const Vec6 bias = (Vec6() << 0, 0, 0, 0, 0, radians(0.2)).finished();
  Square s = make_square(10, bias, nullptr);
  const double open_m = worst_m(s.start, s.truth);
  add_revisits(10, &s);
  const SolvedGraph solved = solve(s.graph, s.start, {50, 1e-4, 1e-6, 1e6, 16.0}, never);
  EXPECT_GT(open_m, 1.5);
  EXPECT_LT((solved.state.T_world_vehicle[40].p - solved.state.T_world_vehicle[0].p).norm(), 0.05);
}

TEST(GraphSolver, AFalseRevisitDoesNotDistortTheSquare) {
  std::mt19937 random(11);
  Square s = make_square(10, Vec6::Zero(), &random);
  add_revisits(10, &s);
  const SolvedGraph before = solve(s.graph, s.start, {}, never);
  MatchEdge wrong = s.graph.matches[5];
  wrong.scan += 3;
  wrong.T_map_scan = wrong.T_map_scan * Pose{exp_so3(Vec3(0, 0, 0.1)), Vec3(1.0, -2.0, 0.3)};
  s.graph.matches.push_back(wrong);
  const SolvedGraph after = solve(s.graph, s.start, {}, never);
  EXPECT_LT(after.match_weight.back(), 0.01);
  EXPECT_GT(after.match_weight.front(), 0.25);
  EXPECT_EQ(after.fit[static_cast<std::size_t>(EdgeKind::kRevisit)].suspect, 1U);
  double worst = 0.0;
  for (std::size_t k = 0; k < s.truth.size(); ++k) {
    worst = std::max(worst,
                     (after.state.T_world_vehicle[k].p - before.state.T_world_vehicle[k].p).norm());
  }
  EXPECT_LT(worst, 0.005);
}

TEST(GraphSolver, UndeterminedVariablesAreReported) {
  Square s = make_square(3, Vec6::Zero(), nullptr);
  s.graph.priors.first_pose.reset();
  EXPECT_TRUE(solve(s.graph, s.start, {}, never).singular);
}

TEST(GraphSolver, CovarianceMatchesTheErrorsOfManyNoisyDrives) {
  // True and stated sigmas are equal: the mean of squared errors over variance is one.
  std::mt19937 random(5);
  double nees = 0.0;
  double nees_from_first = 0.0;
  int count = 0;
  for (int trial = 0; trial < 40; ++trial) {
    Square s = make_square(4, Vec6::Zero(), &random);
    const SolvedGraph solved = solve(s.graph, s.start, {}, never);
    const GraphCovariance c = covariance(s.graph, solved, {});
    for (const std::size_t k : {10U, 31U}) {
      const Vec6 xi = log_se3(solved.state.T_world_vehicle[k].inverse() * s.truth[k]);
      nees += xi.dot(c.pose[k].ldlt().solve(xi)) / 6.0;
      const Pose T = solved.state.T_world_vehicle[0].inverse() * solved.state.T_world_vehicle[k];
      const Vec6 from = log_se3(T.inverse() * s.truth[0].inverse() * s.truth[k]);
      nees_from_first += from.dot(c.from_first[k].ldlt().solve(from)) / 6.0;
      ++count;
    }
  }
  EXPECT_NEAR(nees / count, 1.0, 0.25);
  EXPECT_NEAR(nees_from_first / count, 1.0, 0.25);
}

TEST(SelectedInverse, EqualsTheDenseInverseWhereTheFactorHasEntries) {
  std::mt19937 random(2);
  std::normal_distribution<double> normal(0.0, 1.0);
  const int n = 40;
  MatrixXd A = MatrixXd::Zero(n, n);
  for (int k = 0; k < n; ++k) A(k, k) = 12.0;
  for (int k = 0; k < 60; ++k) {
    const int i = static_cast<int>(random() % n);
    const int j = static_cast<int>(random() % n);
    if (i != j) A(i, j) = A(j, i) = normal(random);
  }
  const MatrixXd dense = A.inverse();
  // A sparse factor of it, entries that fill in included.
  MatrixXd L = A.llt().matrixL();
  Eigen::SparseMatrix<double> sparse = L.sparseView(1.0, 1e-300);
  const Eigen::SparseMatrix<double> Z = selected_inverse(sparse);
  ASSERT_LT(Z.nonZeros(), n * (n + 1) / 2);
  for (int j = 0; j < n; ++j) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(Z, j); it; ++it) {
      EXPECT_NEAR(it.value(), dense(it.row(), it.col()), 1e-12);
    }
  }
}

}  // namespace
}  // namespace rcs::smoothing

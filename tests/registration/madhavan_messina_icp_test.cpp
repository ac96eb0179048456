#include "modules/registration/madhavan_messina_icp.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "rcs/base/kd_tree.h"
#include "tests/support/point_scenes.h"

namespace rcs::registration {
namespace {

using test::Ground;

struct Fixture {
  explicit Fixture(unsigned seed = 5) : rng(seed) {
    model = test::scene(Ground::kRolling, true, 3000, 0.01, Vec3::Zero(), &rng);
    // The same points from another pose: the closest point can be the corresponding one.
    data = test::moved(T_true.inverse(), model);
  }
  [[nodiscard]] PaperResult run(const Pose& guess) const {
    return register_as_in_paper(model, data, guess, params);
  }
  [[nodiscard]] double error_m(const PaperResult& r) const {
    return log_se3(T_true.inverse() * r.T_model_data).head<3>().norm();
  }
  std::mt19937 rng;
  Pose T_true = test::pose(1.0, -0.5, 0.3, 0.02, -0.03, 0.1);
  Points model;
  Points data;
  PaperParams params;
};

TEST(KdTree, MatchesBruteForce) {
  Fixture f;
  const KdTree tree(f.model);
  for (std::size_t i = 0; i < f.data.size(); i += 7) {
    const Vec3f p = f.data[i];
    float best = 1e30F;
    for (std::size_t k = 0; k < f.model.size(); ++k) {
      best = std::min(best, (f.model[k] - p).squaredNorm());
    }
    const KdTree::Closest c = tree.closest(p);
    EXPECT_FLOAT_EQ(c.distance2_m2, (f.model[c.index] - p).squaredNorm());
    EXPECT_FLOAT_EQ(c.distance2_m2, best);
  }
  EXPECT_EQ(tree.closest(f.model[17]).distance2_m2, 0.0F);
  EXPECT_GT(tree.closest_other(f.model[17]).distance2_m2, 0.0F);
}

TEST(IcpPaper, FindsThePoseWithBothSolvers) {
  Fixture f;
  const Pose guess = f.T_true * test::pose(0.4, -0.3, 0.2, 0.02, 0.01, 0.05);
  for (const MotionSolver solver : {MotionSolver::kSvd, MotionSolver::kQuaternion}) {
    f.params.solver = solver;
    const PaperResult r = f.run(guess);
    EXPECT_EQ(r.stop, PaperStop::kRelativeChange) << name_of(r.stop);
    EXPECT_LT(f.error_m(r), 1e-3);
    EXPECT_LT(r.mean_distance_m, 1e-3);
    EXPECT_EQ(r.distance_before_m.size(), f.data.size());
    EXPECT_EQ(r.closest.size(), f.data.size());
    EXPECT_GT(r.pairs, 2000);
  }
}

TEST(IcpPaper, MovingTheDataMovesTheResult) {
  Fixture f;
  const Pose guess = f.T_true * test::pose(0.3, 0.0, 0.1, 0.01, 0.0, 0.02);
  const PaperResult before = f.run(guess);
  const Pose T = test::pose(5.0, 2.0, -1.0, 0.1, 0.0, -1.2);
  f.data = test::moved(T, f.data);
  const PaperResult after = f.run(guess * T.inverse());
  EXPECT_LT(log_se3(before.T_model_data.inverse() * after.T_model_data * T).norm(), 1e-3);
}

// Errata 1: as printed, the motion of the model to the data is applied to the data.
TEST(IcpPaper, AsPrintedTheMotionHasTheWrongDirection) {
  Fixture f;
  const Pose guess = f.T_true * test::pose(0.05, 0.0, 0.0, 0.0, 0.0, 0.0);
  f.params.max_iterations = 1;
  EXPECT_LT(f.error_m(f.run(guess)), 0.03);
  f.params.data_to_model = false;
  EXPECT_NEAR(f.error_m(f.run(guess)), 0.1, 0.03) << "twice the error";
}

// Errata 3: pairs that are not accepted must not affect the result.
TEST(IcpPaper, OnlyAcceptedPairsCount) {
  Fixture f;
  const Points outliers = test::moved(test::pose(0.0, 0.0, 30.0, 0.0, 0.0, 0.0), f.data);
  for (std::size_t i = 0; i < outliers.size(); i += 5) f.data.push_back(outliers[i]);
  const Pose guess = f.T_true * test::pose(0.3, 0.0, 0.1, 0.01, 0.0, 0.02);
  EXPECT_LT(f.error_m(f.run(guess)), 0.02);
  f.params.accepted_only = false;
  EXPECT_GT(f.error_m(f.run(guess)), 0.2);
}

// Errata 5: mean and deviation over pairs within the last D_max, which begins at 20 D.
TEST(IcpPaper, StatisticsAreOfThePairsWithinTheLastThreshold) {
  Fixture f;
  f.params.spacing_m = 0.3;
  for (int i = 0; i < 300; ++i) f.data.push_back(Vec3f(1000.0F, 0.0F, 0.0F));
  const Pose guess = f.T_true * test::pose(0.1, 0.0, 0.0, 0.0, 0.0, 0.0);
  const PaperResult gated = f.run(guess);
  EXPECT_EQ(gated.history[0].branch, PaperBranch::kMu3Sigma);
  EXPECT_LT(gated.history[0].mu_m, 0.3);
  EXPECT_LT(f.error_m(gated), 1e-3);
  f.params.gated_statistics = false;
  const PaperResult all = f.run(guess);
  EXPECT_EQ(all.history[0].branch, PaperBranch::kValley);
  EXPECT_GT(all.history[0].mu_m, 50.0);
}

TEST(IcpPaper, EachOfTheFourBranchesIsTaken) {
  Fixture f;
  const auto first = [&](double D) {
    f.params.spacing_m = D;
    f.params.max_iterations = 1;
    return f.run(f.T_true * test::pose(0.0, 0.0, 4.0, 0.0, 0.0, 0.0)).history[0];
  };
  const PaperIteration a = first(10.0);
  EXPECT_EQ(a.branch, PaperBranch::kMu3Sigma);
  EXPECT_NEAR(a.d_max_m, a.mu_m + 3.0 * a.sigma_m, 1e-12);
  const PaperIteration b = first(0.5 * a.mu_m);
  EXPECT_EQ(b.branch, PaperBranch::kMu2Sigma);
  EXPECT_NEAR(b.d_max_m, b.mu_m + 2.0 * b.sigma_m, 1e-12);
  const PaperIteration c = first(0.2 * a.mu_m);
  EXPECT_EQ(c.branch, PaperBranch::kMuSigma);
  EXPECT_NEAR(c.d_max_m, c.mu_m + c.sigma_m, 1e-12);
  const PaperIteration d = first(0.15 * a.mu_m);
  EXPECT_EQ(d.branch, PaperBranch::kValley);
  EXPECT_LE(d.d_max_m, 20.0 * 0.15 * a.mu_m);
  EXPECT_GE(d.d_max_m, 0.15 * a.mu_m);
}

// Errata 4: Zhang's valley.
TEST(IcpPaper, TheValleyIsTheFirstBinBelowSixtyPercentOfThePeak) {
  const auto in_bins = [](const std::vector<int>& counts) {
    std::vector<float> d;
    for (std::size_t k = 0; k < counts.size(); ++k) {
      for (int i = 0; i < counts[k]; ++i) d.push_back(static_cast<float>(k) + 0.5F);
    }
    return d;
  };
  EXPECT_EQ(histogram_valley(in_bins({3, 10, 7, 6, 5, 9}), 1.0, 100.0), 4.0);
  EXPECT_EQ(histogram_valley(in_bins({10, 6, 6}), 1.0, 100.0), 3.0) << "beyond the last bin";
  EXPECT_EQ(histogram_valley(in_bins({10, 1}), 1.0, 100.0), 1.0);
  EXPECT_EQ(histogram_valley(in_bins({1, 1, 1, 10, 1}), 1.0, 3.2), 3.0)
      << "pairs beyond the last D_max are not counted";
  EXPECT_EQ(histogram_valley(in_bins({10, 9, 9, 9}), 1.0, 2.5), 2.5) << "not beyond the last D_max";
  EXPECT_EQ(histogram_valley({}, 0.5, 100.0), 0.5);
  EXPECT_NEAR(histogram_valley({1e30F, 1.0F, std::nanf("")}, 1e-3, 1e9), 1.001, 1e-9);
}

// Errata 6: D grows with range; the median describes most points.
TEST(IcpPaper, TheSpacingIsMeasured) {
  Points grid;
  for (int i = 0; i < 60; ++i) {
    for (int j = 0; j < 60; ++j) {
      grid.push_back({0.25F * static_cast<float>(i), 0.4F * static_cast<float>(j), 0.0F});
    }
  }
  EXPECT_NEAR(measured_spacing(grid), 0.25, 1e-6);
  grid.push_back({1e4F, 0.0F, 0.0F});
  EXPECT_NEAR(measured_spacing(grid), 0.25, 1e-6);
  Points one;
  EXPECT_EQ(measured_spacing(one), 0.0);
  one.push_back(Vec3f::Zero());
  EXPECT_EQ(measured_spacing(one), 0.0);
}

// Errata 7: each rule can terminate the iteration.
TEST(IcpPaper, EveryRuleOfTerminationIsReported) {
  Fixture f;
  const Pose guess = f.T_true * test::pose(0.4, -0.3, 0.2, 0.02, 0.01, 0.05);
  f.params.max_iterations = 2;
  EXPECT_EQ(f.run(guess).stop, PaperStop::kMaxIterations);
  EXPECT_EQ(f.run(guess).history.size(), 2U);
  f.params.max_iterations = 200;
  f.params.mean_distance_m = 0.05;
  EXPECT_EQ(f.run(guess).stop, PaperStop::kMeanDistance);
  f.params.mean_distance_m = 0.0;
  EXPECT_EQ(f.run(guess).stop, PaperStop::kRelativeChange);
  // Without the other rules the same pairs give the same pose forever.
  f.params.relative_change = 0.0;
  EXPECT_EQ(f.run(guess).stop, PaperStop::kLimitCycle);
  f.params.detect_cycles = false;
  EXPECT_EQ(f.run(guess).stop, PaperStop::kMaxIterations);
}

TEST(IcpPaper, InvalidInputGetsAResult) {
  Fixture f;
  const PaperParams p;
  const Points none;
  EXPECT_EQ(register_as_in_paper(none, f.data, {}, p).stop, PaperStop::kEmpty);
  EXPECT_EQ(register_as_in_paper(f.model, none, {}, p).stop, PaperStop::kEmpty);
  Points one;
  one.push_back(Vec3f(1.0F, 2.0F, 3.0F));
  EXPECT_EQ(register_as_in_paper(one, one, {}, p).stop, PaperStop::kTooFew);
  Points line;
  for (int i = 0; i < 50; ++i) line.push_back(static_cast<float>(i) * Vec3f(1.0F, 0.5F, 0.0F));
  EXPECT_EQ(register_as_in_paper(line, line, {}, p).stop, PaperStop::kDegenerate);
  Points same;
  for (int i = 0; i < 50; ++i) same.push_back(Vec3f(1.0F, 2.0F, 3.0F));
  EXPECT_EQ(register_as_in_paper(same, same, {}, p).stop, PaperStop::kDegenerate);
  Points twice = f.model;
  for (std::size_t i = 0; i < f.model.size(); ++i) twice.push_back(f.model[i]);
  const PaperResult r = register_as_in_paper(twice, f.data, f.T_true, p);
  EXPECT_EQ(r.stop, PaperStop::kRelativeChange);
  EXPECT_GE(r.spacing_m, 0.0);
}

}  // namespace
}  // namespace rcs::registration

#include "tools/studies/scan_pairs.h"

#include <gtest/gtest.h>

#include <set>
#include <tuple>

namespace rcs::studies {
namespace {

std::vector<ScanPair> some_pairs() {
  return {{0, 1, {Quat::Identity(), Vec3(0.4, 0.0, 0.0)}},
          {10, 11, {Quat::Identity(), Vec3(0.5, 0.0, 0.0)}},
          {0, 20, {exp_so3(Vec3(0.0, 0.0, 0.2)), Vec3(8.0, 1.0, 0.0)}}};
}

TEST(ScanPairs, AnOffsetHasItsMagnitude) {
  std::mt19937 rng(1);
  Vec3 sum = Vec3::Zero();
  constexpr int kMany = 1000;
  for (int i = 0; i < kMany; ++i) {
    const Pose T = random_offset({3.0, 0.5}, &rng);
    EXPECT_NEAR(T.p.norm(), 3.0, 1e-12);
    EXPECT_NEAR(log_so3(T.q).norm(), 0.5, 1e-12);
    sum += T.p / 3.0;
  }
  // The mean of unit vectors: each axis has sigma 1 / sqrt(3 n) = 0.018; this is five of them.
  EXPECT_LT((sum / kMany).cwiseAbs().maxCoeff(), 0.09);
}

TEST(ScanPairs, DataSetsBeginAtTheirConfiguredScans) {
  const std::vector<ScanPair> pairs = some_pairs();
  const std::vector<Trial> one = trials_of(DataSet::kConsecutive, pairs, 25);
  ASSERT_EQ(one.size(), 2U);
  EXPECT_EQ(one[1].pair.model, 10);
  EXPECT_EQ(one[1].guess.p, Vec3::Zero());

  const std::vector<Trial> two = trials_of(DataSet::kTwentyApart, pairs, 25);
  const std::vector<Trial> three = trials_of(DataSet::kMovedBy1m, pairs, 25);
  ASSERT_EQ(two.size(), 25U);
  ASSERT_EQ(three.size(), 25U);
  for (std::size_t i = 0; i < two.size(); ++i) {
    const Offset off = error_of(two[i].pair.T_model_data, two[i].guess);
    EXPECT_NEAR(off.m, 0.3, 1e-9);
    EXPECT_NEAR(off.rad, radians(1.0), 1e-9);
    EXPECT_LT((three[i].guess.p - two[i].guess.p - Vec3::Ones()).norm(), 1e-12);
  }

  const std::vector<Trial> four = trials_of(DataSet::kTurnedAndMovedBy3m, pairs, 16);
  ASSERT_EQ(four.size(), 32U);
  std::set<std::tuple<bool, bool, bool, bool>> signs;
  for (const Trial& t : four) {
    EXPECT_NEAR(std::abs(yaw_of(t.guess.q)), radians(10.0), 1e-12);
    EXPECT_LT((t.guess.p.cwiseAbs() - 3.0 * Vec3::Ones()).norm(), 1e-12);
    signs.insert({yaw_of(t.guess.q) > 0, t.guess.p.x() > 0, t.guess.p.y() > 0, t.guess.p.z() > 0});
  }
  EXPECT_EQ(signs.size(), 16U);
}

TEST(ScanPairs, TheBasinUsesConsecutiveScansAndItsOwnSeeds) {
  const std::vector<Trial> trials = basin_trials(some_pairs(), {5.0, radians(45.0)}, 3);
  ASSERT_EQ(trials.size(), 6U);
  const std::vector<Trial> again = basin_trials(some_pairs(), {5.0, radians(45.0)}, 3);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Offset off = error_of(trials[i].pair.T_model_data, trials[i].guess);
    EXPECT_NEAR(off.m, 5.0, 1e-9);
    EXPECT_NEAR(off.rad, radians(45.0), 1e-9);
    EXPECT_EQ(trials[i].guess.p, again[i].guess.p);
  }
  EXPECT_GT((trials[0].guess.p - trials[1].guess.p).norm(), 0.1);
}

TEST(ScanPairs, GlobalGuessesFillTheDiscAndAllHeadings) {
  const std::vector<Trial> trials = global_trials(some_pairs(), 10.0, 0.05, 200);
  ASSERT_EQ(trials.size(), 400U);
  double farthest_m = 0.0;
  double max_turned_rad = 0.0;
  int within_half = 0;
  for (const Trial& t : trials) {
    const Pose off = t.pair.T_model_data.inverse() * t.guess;
    EXPECT_EQ(off.p.z(), 0.0);
    farthest_m = std::max(farthest_m, off.p.norm());
    within_half += off.p.norm() < 5.0 ? 1 : 0;
    max_turned_rad = std::max(max_turned_rad, log_so3(off.q).norm());
    EXPECT_GT((off.q * Vec3::UnitZ()).z(), std::cos(0.05 * std::sqrt(2.0)) - 1e-6);
  }
  EXPECT_LE(farthest_m, 10.0);
  EXPECT_GT(farthest_m, 9.8);
  EXPECT_GT(max_turned_rad, 3.0);
  EXPECT_NEAR(within_half, 100, 45);  // a quarter of the disc; five sigmas
}

}  // namespace
}  // namespace rcs::studies

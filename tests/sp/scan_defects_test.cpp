// Each defect affects exactly the requested share of a scan.

#include "tests/sp/scan_defects.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/support/point_scenes.h"

namespace rcs::test {
namespace {

KnownPair some_pair() {
  std::mt19937 rng(1);
  KnownPair pair;
  pair.T_model_data = test::pose(1.0, 0.5, 0.1, 0.0, 0.0, 0.1);
  pair.model = test::scene(test::Ground::kRolling, true, 4000, 0.01, Vec3::Zero(), &rng);
  pair.data = test::moved(pair.T_model_data.inverse(), pair.model);
  return pair;
}

std::vector<double> moved_by(const Points& before, const Points& after) {
  std::vector<double> all;
  for (std::size_t i = 0; i < before.size(); ++i) all.push_back((before[i] - after[i]).norm());
  return all;
}

TEST(ScanDefects, OutliersHaveTheRequestedShare) {
  const KnownPair good = some_pair();
  KnownPair bad = good;
  std::mt19937 rng(2);
  add_outliers(0.3, &rng, &bad);
  ASSERT_EQ(bad.data.size(), good.data.size());
  int changed = 0;
  for (const double m : moved_by(good.data, bad.data)) changed += m > 0.0 ? 1 : 0;
  EXPECT_EQ(changed, 1200);
  EXPECT_EQ(bad.model.x, good.model.x);
}

TEST(ScanDefects, ObjectsMoveByTheRequestedDistance) {
  const KnownPair good = some_pair();
  KnownPair bad = good;
  std::mt19937 rng(3);
  move_objects(0.3, &rng, &bad);
  int changed = 0;
  for (const double m : moved_by(good.data, bad.data)) {
    changed += m > 0.0 ? 1 : 0;
    EXPECT_TRUE(m == 0.0 || (m > 0.499 && m < 2.001)) << m;
  }
  EXPECT_EQ(changed, 1200);
}

TEST(ScanDefects, OccludedPointsAreOnOneSide) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    KnownPair pair = some_pair();
    std::mt19937 rng(seed);
    occlude(0.5, &rng, &pair);
    EXPECT_NEAR(static_cast<double>(pair.data.size()), 2000.0, 2.0);
    EXPECT_EQ(pair.model.size(), 4000U);
  }
}

// The data are the model's own points: the lost points are those that are not covered.
TEST(ScanDefects, TheModelLosesTheRequestedShareOfCoverage) {
  for (unsigned seed = 0; seed < 6; ++seed) {
    KnownPair pair = some_pair();
    std::mt19937 rng(seed);
    crop_model(0.4, &rng, &pair);
    EXPECT_NEAR(static_cast<double>(pair.model.size()), 2400.0, 2.0);
    EXPECT_EQ(pair.data.size(), 4000U);
  }
}

}  // namespace
}  // namespace rcs::test

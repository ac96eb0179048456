#include "modules/sp/scan/scan_repetition.h"

#include <gtest/gtest.h>

#include <random>

namespace rcs::sp {
namespace {

Points scan(std::uint32_t seed, std::size_t n = 400) {
  std::mt19937 rng(seed);
  std::normal_distribution<float> range(10.0F, 0.03F);
  Points points;
  for (std::size_t k = 0; k < n; ++k) points.push_back(Vec3f(range(rng), range(rng), range(rng)));
  return points;
}

TEST(ScanRepetition, OfTheSamePointsOnly) {
  ScanRepetition r;
  EXPECT_FALSE(r.repeats(scan(1)));
  EXPECT_TRUE(r.repeats(scan(1)));
  EXPECT_TRUE(r.repeats(scan(1)));
  EXPECT_FALSE(r.repeats(scan(2))) << "the LADAR measures again";
  EXPECT_FALSE(r.repeats(scan(1)));
  EXPECT_FALSE(r.repeats(scan(1, 399)));
}

// An obscured LADAR returns nothing, scan for scan; what little it returns can be equal by chance.
TEST(ScanRepetition, HardlyAnyPointsAreNoRepetition) {
  ScanRepetition r;
  for (int k = 0; k < 3; ++k) EXPECT_FALSE(r.repeats({}));
  for (int k = 0; k < 3; ++k) EXPECT_FALSE(r.repeats(scan(3, 20)));
}

}  // namespace
}  // namespace rcs::sp

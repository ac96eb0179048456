#include "sim/terrain/relief.h"

#include <gtest/gtest.h>

#include <cmath>

namespace rcs::sim {
namespace {

TEST(Relief, EveryOctaveHasItsRms) {
  for (const double spacing_m : {0.2, 6.4, 102.4}) {
    const Relief relief(3, {{spacing_m, 2.0}}, {});
    double sum = 0.0;
    double squares = 0.0;
    const int side = 120;
    for (int j = 0; j < side; ++j) {
      for (int i = 0; i < side; ++i) {
        const double z = relief.height(1.37 * spacing_m * i, 1.37 * spacing_m * j);
        sum += z;
        squares += z * z;
      }
    }
    EXPECT_NEAR(std::sqrt(squares / (side * side)), 2.0, 0.1) << spacing_m;
    EXPECT_NEAR(sum / (side * side), 0.0, 0.15) << spacing_m;
  }
}

TEST(Relief, FillEqualsHeightOnALattice) {
  const Relief relief(4, {{51.2, 3.0}, {6.4, 0.5}, {0.4, 0.05}}, {});
  std::vector<float> z;
  relief.fill(-37, 1211, 0.1, 40, 30, &z);
  for (int j = 0; j < 30; ++j) {
    for (int i = 0; i < 40; ++i) {
      EXPECT_NEAR(z[static_cast<std::size_t>(j * 40 + i)],
                  relief.height((i - 37) * 0.1, (j + 1211) * 0.1), 1e-5);
    }
  }
}

TEST(Relief, OverlappingFillsAgreeToTheBit) {
  const Relief relief(4, {{51.2, 3.0}, {6.4, 0.5}, {0.2, 0.05}}, {});
  std::vector<float> a, b;
  relief.fill(0, 0, 0.1, 129, 5, &a);
  relief.fill(128, 0, 0.1, 129, 5, &b);
  for (std::size_t j = 0; j < 5; ++j) EXPECT_EQ(a[j * 129 + 128], b[j * 129]);
}

TEST(Relief, DifferentSeedsGiveDifferentRelief) {
  const std::vector<Octave> octaves = {{10.0, 1.0}};
  EXPECT_NE(Relief(1, octaves, {}).height(3.0, 4.0), Relief(2, octaves, {}).height(3.0, 4.0));
}

}  // namespace
}  // namespace rcs::sim

#include "rcs/base/stamp.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace rcs {
namespace {

TEST(Stamp, SecondsRoundToTheNearestMicrosecond) {
  EXPECT_EQ(from_seconds(1.4e-6), Duration(1));
  EXPECT_EQ(from_seconds(-1.6e-6), Duration(-2));
  EXPECT_EQ(from_seconds(1.6e9), Duration(1'600'000'000'000'000));
}

TEST(Stamp, SecondsOutOfRangeAreClamped) {
  constexpr double kInf = std::numeric_limits<double>::infinity();
  for (const double far : {1e13, 1e32, 1e308, kInf}) {
    EXPECT_EQ(from_seconds(far), kMaxDuration) << far;
    EXPECT_EQ(from_seconds(-far), -kMaxDuration) << far;
    EXPECT_EQ(from_milliseconds(1e3 * far), kMaxDuration) << far;
    EXPECT_FALSE(checked_seconds(far)) << far;
    EXPECT_FALSE(checked_seconds(-far)) << far;
  }
  EXPECT_EQ(from_seconds(std::nan("")), kMaxDuration);
  EXPECT_FALSE(checked_seconds(std::nan("")));
  EXPECT_EQ(checked_seconds(-2.5), Duration(-2'500'000));
}

}  // namespace
}  // namespace rcs

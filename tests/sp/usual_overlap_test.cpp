// What share of a scan is unusual here.
#include "modules/sp/usual_overlap.h"

#include <gtest/gtest.h>

namespace rcs::sp {
namespace {

TEST(UsualOverlap, BetweenWallsASmallLossIsUnusual) {
  UsualOverlap usual;
  for (int k = 0; k < 25; ++k) usual.add(0.71 + 0.002 * (k % 3));
  EXPECT_NEAR(usual.mean(), 0.712, 0.003);
  EXPECT_GT(usual.least(), 0.66);  // 0.61: a metre along the street
}

TEST(UsualOverlap, InGrassALargeOneIsNot) {
  UsualOverlap usual;
  for (int k = 0; k < 25; ++k) usual.add(k % 2 == 0 ? 0.3 : 0.5);
  EXPECT_NEAR(usual.least(), 0.8 * usual.mean(), 1e-9);
}

TEST(UsualOverlap, AFewScansTellNothingOfHowMuchItVaries) {
  UsualOverlap usual;
  for (int k = 0; k < 9; ++k) usual.add(0.7);
  EXPECT_NEAR(usual.least(), 0.8 * 0.7, 1e-9);
  usual.add(0.7);
  EXPECT_NEAR(usual.least(), 0.95 * 0.7, 1e-9);
}

TEST(UsualOverlap, AnotherMapBeginsAgain) {
  UsualOverlap usual;
  usual.add(0.7);
  usual.forget();
  EXPECT_EQ(usual.mean(), 0.0);
  EXPECT_EQ(usual.least(), 0.0);
  usual.add(0.4);
  EXPECT_NEAR(usual.mean(), 0.4, 1e-9);
}

}  // namespace
}  // namespace rcs::sp

#include "modules/bg/scan_watch.h"

#include <gtest/gtest.h>

namespace rcs::bg {
namespace {

Stamp at(double t_s) { return Stamp(from_seconds(t_s)); }

TEST(ScanWatch, ScansAreNewThenLost) {
  ScanWatch watch;
  EXPECT_EQ(watch.update(at(10.0), at(10.1)), Scans::kNew);
  EXPECT_EQ(watch.update(at(10.2), at(10.3)), Scans::kNew);
  EXPECT_EQ(watch.update(at(10.2), at(10.4)), Scans::kNone);
  EXPECT_EQ(watch.update(at(10.2), at(10.5)), Scans::kLost);
  EXPECT_EQ(watch.update(at(14.0), at(14.1)), Scans::kNew);
  EXPECT_EQ(watch.update(at(14.0), at(14.35)), Scans::kLost) << "the loss is no interval of scans";
}

TEST(ScanWatch, ALateScanIsNeitherNewNorLost) {
  ScanWatch watch;
  EXPECT_EQ(watch.update(at(10.0), at(10.4)), Scans::kNone);
  EXPECT_EQ(watch.update(at(10.2), at(10.6)), Scans::kNone);
}

TEST(ScanWatch, ASlowLadarIsNotLostBetweenItsScans) {
  ScanWatch watch;
  for (double t_s = 10.0; t_s < 20.0; t_s += 0.42) {
    EXPECT_EQ(watch.update(at(t_s), at(t_s + 0.1)), Scans::kNew);
    if (t_s < 10.4) continue;  // the interval is not known yet
    EXPECT_EQ(watch.update(at(t_s), at(t_s + 0.3)), Scans::kNone);
    EXPECT_EQ(watch.update(at(t_s), at(t_s + 0.5)), Scans::kNone);
  }
  EXPECT_EQ(watch.update(at(19.66), at(20.4)), Scans::kLost);
}

TEST(ScanWatch, AStepBackBeginsAgain) {
  ScanWatch watch;
  EXPECT_EQ(watch.update(at(1000.0), at(1000.1)), Scans::kNew);
  EXPECT_EQ(watch.update(at(10.0), at(10.1)), Scans::kNew);
  EXPECT_EQ(watch.update(at(10.2), at(10.3)), Scans::kNew);
}

}  // namespace
}  // namespace rcs::bg

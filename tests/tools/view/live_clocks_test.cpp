// The clocks of a bus as the viewer sees it.

#include <gtest/gtest.h>

#include "tools/view/source/live_clocks.h"

namespace rcs::view {
namespace {

using std::chrono::milliseconds;

class Clocks : public testing::Test {
 protected:
  /// Messages of 20 Hz from `from_s` to `to_s`; the clock of the channel is `behind_s` behind the
  /// wall clock.
  /// @return how often the clocks became known
  int run(const char* channel, double from_s, double to_s, double behind_s) {
    int changes = 0;
    for (double t = from_s; t < to_s; t += 0.05) {
      const Stamp received = Stamp(from_seconds(kWall_s + t));
      const std::int64_t utime = to_utime(received) - to_us(behind_s) - 2000;
      changes += clocks_.add(channel, utime, received, Stamp(from_seconds(t))) ? 1 : 0;
    }
    return changes;
  }
  static std::int64_t to_us(double s) { return static_cast<std::int64_t>(s * 1e6); }
  static constexpr double kWall_s = 1.7e9;

  LiveClocks clocks_;
};

TEST_F(Clocks, AreKnownAfterAMoment) {
  EXPECT_EQ(run("GPS_FIX", 0.0, 0.3, 1000.0), 0);
  EXPECT_FALSE(clocks_.known());
  EXPECT_EQ(run("GPS_FIX", 0.3, 2.0, 1000.0), 1);
  EXPECT_EQ(clocks_.offsets().sensor_us, to_us(1000.0) + 2000);
}

TEST_F(Clocks, ASensorThatStartsLaterThanTheNodesIsFound) {
  EXPECT_EQ(run("WM_CYCLE", 0.0, 60.0, 500.0), 1);
  EXPECT_EQ(clocks_.offsets().sensor_us, 0);
  int changes = 0;
  for (double t = 60.0; t < 62.0; t += 0.05) {
    changes += run("WM_CYCLE", t, t + 0.05, 500.0);
    changes += run("INS", t, t + 0.05, 1000.0);
  }
  EXPECT_EQ(changes, 1);
  EXPECT_EQ(clocks_.offsets().sensor_us, to_us(1000.0) + 2000);
  EXPECT_EQ(clocks_.offsets().node_us, to_us(500.0) + 2000);
}

TEST_F(Clocks, ASimulationThatBeginsAgainIsFound) {
  EXPECT_EQ(run("INS", 0.0, 30.0, 1000.0), 1);
  EXPECT_EQ(run("INS", 30.0, 35.0, 1030.0), 1);
  EXPECT_EQ(clocks_.offsets().sensor_us, to_us(1030.0) + 2000);
}

TEST_F(Clocks, OneSensorWithAWrongClockChangesNothing) {
  EXPECT_EQ(run("INS", 0.0, 1.0, 1000.0), 1);
  for (double t = 1.0; t < 30.0; t += 0.05) {
    EXPECT_EQ(run("INS", t, t + 0.05, 1000.0), 0);
    EXPECT_EQ(run("GPS_FIX", t, t + 0.05, 1090.0), 0);
  }
  EXPECT_EQ(clocks_.offsets().sensor_us, to_us(1000.0) + 2000);
}

}  // namespace
}  // namespace rcs::view

#include "rcs/ros2/clock_estimate.h"

#include <gtest/gtest.h>

namespace rcs::ros2 {
namespace {

TEST(ClockEstimate, OffsetsAreThoseOfTheLeastDelay) {
  constexpr std::int64_t kUtc = 1'395'837'296'000'000;
  ClockEstimate clocks;
  for (std::int64_t i = 0; i < 200; ++i) {
    const Stamp stamp = from_utime(kUtc + 100'000 * i);
    clocks.add("INS", kUtc + 100'000 * i - 2'000, stamp);  // the sensor has UTC
    clocks.add("WM_EVENT", 7'000'000 + 100'000 * i - (i % 7 == 3 ? 100 : 3000), stamp);
    clocks.add("WM_NAV_STATE", 5, stamp);  // of neither clock
  }
  EXPECT_TRUE(clocks.complete());
  EXPECT_EQ(clocks.offsets().sensor_us, 0);
  EXPECT_EQ(clocks.offsets().node_us, kUtc - 7'000'000 + 100);
  EXPECT_EQ(ClockEstimate{}.offsets().node_us, 0);
}

TEST(ClockEstimate, EachChannelHasAClock) {
  EXPECT_EQ(clock_of("GPS_FIX"), ChannelClock::kSensor);
  EXPECT_EQ(clock_of("UP_PROCESS"), ChannelClock::kNode);
  EXPECT_EQ(clock_of("BG_STATUS"), ChannelClock::kNode);
  EXPECT_EQ(clock_of("BG_COMMAND"), ChannelClock::kOther);
}

}  // namespace
}  // namespace rcs::ros2

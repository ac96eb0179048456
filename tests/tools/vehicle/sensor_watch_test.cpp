#include "tools/rcs/vehicle/sensor_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace rcs::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr Stamp at_s(double s) { return Stamp(from_seconds(s)); }

cycle_t account(const std::string& channel, std::int64_t received) {
  cycle_t m{};
  m.n_inputs = 1;
  m.input.resize(1);
  m.input[0].channel = channel;
  m.input[0].received = received;
  return m;
}

TEST(SensorWatch, ReportsEachSensorWithoutDataOnceAndItsFirstData) {
  SensorWatch watch(at_s(100.0), true);
  watch.on_cycle(account(channel::kIns, 3));
  watch.on_cycle(account(channel::kGpsFix, 0));
  EXPECT_THAT(watch.due(at_s(107.9)), IsEmpty());
  EXPECT_THAT(watch.due(at_s(108.0)),
              ElementsAre(HasSubstr("GPS: no data received on GPS_FIX since the start 8 s ago; "
                                    "check the GPS driver (1 to 10 Hz)"),
                          HasSubstr("odometry: no data received on ODOMETRY"),
                          HasSubstr("LADAR: no data received on LADAR_RANGES or LADAR_POINTS")));
  EXPECT_THAT(watch.due(at_s(109.0)), IsEmpty());
  watch.on_cycle(account(channel::kLadarPoints, 1));
  EXPECT_THAT(watch.due(at_s(110.0)),
              ElementsAre("LADAR: first data received on LADAR_RANGES or LADAR_POINTS"));
  EXPECT_THAT(watch.due(at_s(111.0)), IsEmpty());
}

TEST(SensorWatch, AVehicleWithoutSpNeedsNoLadar) {
  SensorWatch watch(at_s(0.0), false);
  for (const char* channel : {channel::kIns, channel::kGpsFix, channel::kOdometry}) {
    watch.on_cycle(account(channel, 1));
  }
  EXPECT_THAT(watch.due(at_s(20.0)), IsEmpty());
}

}  // namespace
}  // namespace rcs::cli

// `rcs up` hangs while the vehicle drives: the vehicle stops, no node blocks although nobody reads
// what they print, and all goes on when `rcs up` does. RCS_DRILL_TIMES: repetitions, default 5.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "tests/live_faults/live_fault.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kPatience = from_seconds(60.0);
constexpr Duration kHangs = from_seconds(12.0);
constexpr Duration kRestWithin = from_seconds(8.0);  // 3 s of silence, and braking
constexpr double kRest_mps = 0.15;

TEST(HungSupervisor, StopsTheVehicleAndBlocksNoNode) {
  const int times = number_from("RCS_DRILL_TIMES", 5);
  LiveFault live;
  ASSERT_NE(live.run.bus(), nullptr) << live.run.trouble();
  Bus* const bus = live.run.bus();
  double speed_mps = 0.0;
  std::string state;
  Duration longest{};  // between two drive commands
  std::optional<Stamp> last_drive;
  Tap<truth_t> truth(bus, channel::kSimTruth, [&](const truth_t& m, Stamp) {
    speed_mps = std::hypot(m.v_world_mps[0], m.v_world_mps[1]);
  });
  Tap<status_t> status(bus, channel::kBgStatus, [&](const status_t& m, Stamp) { state = m.state; });
  Tap<drive_t> drives(bus, channel::kBgDrive, [&](const drive_t&, Stamp at) {
    if (last_drive) longest = std::max(longest, at - *last_drive);
    last_drive = at;
  });
  Duration slowest{};
  for (int i = 0; i < times; ++i) {
    ASSERT_TRUE(live.run_until_well(kPatience)) << live.run.trouble();
    ASSERT_TRUE(live.run.run_until(live.run.now() + kPatience, [&] { return speed_mps > 2.0; }));
    const Stamp begin = live.run.now();
    longest = Duration::zero();
    live.run.send_signal_to_up(SIGSTOP);
    const bool stopped = live.run.run_until(
        begin + kRestWithin, [&] { return state == "SUPERVISOR_SILENT" && speed_mps < kRest_mps; });
    slowest = std::max(slowest, live.run.now() - begin);
    EXPECT_TRUE(stopped) << "state " << state << ", " << speed_mps << " m/s";
    (void)live.run.run_until(begin + kHangs, {});
    EXPECT_EQ(state, "SUPERVISOR_SILENT");
    EXPECT_LT(longest, from_milliseconds(500.0)) << "a cycle of BG was blocked";
    live.run.send_signal_to_up(SIGCONT);
  }
  EXPECT_TRUE(live.run_until_well(kPatience)) << live.run.trouble();
  EXPECT_EQ(live.breaches(), "");
  fmt::print("{} times: at rest after at most {:.1f} s\n", times, seconds(slowest));
}

}  // namespace
}  // namespace rcs::live_faults

// stdout and stderr of a process are a pipe that is full and that nobody reads: of each node, of
// `rcs up`, and of all of them. The vehicle drives, stops for an emergency stop, and drives on; a
// node that is killed is restarted, and every process ends on SIGTERM. RCS_DRILL_TIMES: drives with
// each, default 5.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/live_faults/live_fault.h"
#include "tests/live_faults/redirected_programs.h"
#include "tests/support/fresh_folder.h"
#include "tests/support/full_pipe.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kPatience = from_seconds(60.0);
constexpr Duration kProgram = from_seconds(30.0);
constexpr Duration kDrives = from_seconds(5.0);
constexpr Duration kMaxGap = from_milliseconds(500.0);  // between drive commands
constexpr Duration kEndsWithin = from_seconds(2.9);     // `rcs up` kills what takes 3 s
constexpr double kRest_mps = 0.15;

/// Of one drive.
struct Outcome {
  Duration gap{};                    ///< longest between drive commands while BG lives
  std::optional<Duration> rest;      ///< from the stop
  std::optional<Duration> recovery;  ///< from kill -9
  Duration end{};                    ///< until all processes have ended
};

class BlockedOutput : public testing::Test {
 protected:
  BlockedOutput()
      : folder_(rcs::test::fresh_folder()), pipe_(folder_ / "full"), programs_(folder_ / "bin") {}

  /// @param killed  a node whose end makes others print, and whose successor prints, too
  void drill(const std::vector<std::string>& blocked, const std::string& killed) {
    for (const std::string& program : blocked) programs_.redirect(program, pipe_.path());
    const int times = number_from("RCS_DRILL_TIMES", 5);
    Outcome worst;
    for (int k = 0; k < times && !HasFailure(); ++k) {
      const Outcome o = drive(killed);
      worst.gap = std::max(worst.gap, o.gap);
      worst.rest = std::max(worst.rest, o.rest);
      worst.recovery = std::max(worst.recovery, o.recovery);
      worst.end = std::max(worst.end, o.end);
    }
    EXPECT_TRUE(pipe_.full());
    std::printf(
        "%d drives, no output of %s: drive commands at most %.0f ms apart, at rest after at most "
        "%.1f s, recovered from kill -9 of %s after at most %.1f s, ended after at most %.1f s\n",
        times, blocked.size() == 1 ? blocked[0].c_str() : "any process", milliseconds(worst.gap),
        seconds(worst.rest.value_or(Duration(-1))), killed.c_str(),
        seconds(worst.recovery.value_or(Duration(-1))), seconds(worst.end));
  }

 private:
  static Outcome drive(const std::string& killed) {
    Outcome out;
    // WM reports the silence of GPS and its end.
    LiveFault live("", {"--silence", "gps,16,3"});
    if (live.run.bus() == nullptr) {
      ADD_FAILURE() << live.run.trouble();
      return out;
    }
    bool alive = false;
    std::optional<Stamp> last;
    std::string state;
    Tap<drive_t> drives(live.run.bus(), channel::kBgDrive, [&](const drive_t&, Stamp at) {
      if (alive && last) out.gap = std::max(out.gap, at - *last);
      last = at;
    });
    Tap<status_t> status(live.run.bus(), channel::kBgStatus,
                         [&](const status_t& m, Stamp) { state = m.state; });
    const auto well = [&](const char* when) {
      live.recovery.reset();
      EXPECT_TRUE(live.run_until_well(kPatience))
          << when << ": " << live.recovery.missing() << "; " << live.run.trouble();
    };
    well("at first");
    alive = true;
    live.run_for(kDrives);
    const Stamp stop = live.run.now();
    EXPECT_EQ(live.run.run_program("rcs", {"go", "--emergency-stop", "--timeout", "20"}, kProgram),
              0);
    const auto at_rest = [&] {
      return state == "EMERGENCY_STOP" && live.safety.speed_mps() < kRest_mps;
    };
    EXPECT_TRUE(live.run.run_until(stop + kPatience, at_rest)) << "state " << state;
    out.rest = live.run.now() - stop;
    EXPECT_EQ(live.run.run_program("rcs", {"go", "--release", "--timeout", "20"}, kProgram), 0);
    well("after the release");
    alive = killed != "bg";
    const int pid = live.run.pid_of(killed);
    const Stamp kill = live.run.now();
    live.run.send_signal(killed, SIGKILL);
    const auto another = [&] { return live.run.pid_of(killed) != pid; };
    EXPECT_TRUE(live.run.run_until(kill + kPatience, another)) << killed << " is not back";
    well("after the kill");
    out.recovery = live.recovery.recovered().value_or(live.run.now()) - kill;
    EXPECT_LT(out.gap, kMaxGap);
    EXPECT_EQ(live.run.trouble(), "");
    EXPECT_EQ(live.breaches(), "");
    const Stamp begin = live.run.now();
    (void)live.run.end();
    out.end = live.run.now() - begin;
    EXPECT_LT(out.end, kEndsWithin);
    return out;
  }

  std::filesystem::path folder_;
  rcs::test::FullPipe pipe_;
  RedirectedPrograms programs_;
};

TEST_F(BlockedOutput, OfSp) { drill({"sp"}, "sp"); }
TEST_F(BlockedOutput, OfWm) { drill({"wm"}, "wm"); }
TEST_F(BlockedOutput, OfBg) { drill({"bg"}, "bg"); }
TEST_F(BlockedOutput, OfTheGateway) { drill({"gateway"}, "gateway"); }
TEST_F(BlockedOutput, OfRcsUp) { drill({"up"}, "sp"); }
TEST_F(BlockedOutput, OfAllProcesses) { drill({"sp", "wm", "bg", "gateway", "up"}, "bg"); }

}  // namespace
}  // namespace rcs::live_faults

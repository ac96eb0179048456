// The sensors of a driving vehicle fall silent: the simulator is killed or stopped, or one driver
// stops publishing. RCS_DRILL_TIMES: repetitions of each, default 30 for the kill, otherwise 10.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/node/bus/tap.h"
#include "tests/live_faults/live_fault.h"
#include "tests/live_faults/vehicle_run.h"
#include "tools/rcs/vehicle/child_process.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kPatience = from_seconds(60.0);
constexpr Duration kWatched = from_seconds(4.0);
constexpr Duration kBrakeWithin = from_milliseconds(500.0);
constexpr double kDrives_mps = 1.0;
constexpr int kVoid = 5;  // trials in a row that may say nothing

/// What the nodes published since the sensors fell silent.
struct Seen {
  bool drove = false;                ///< before
  std::optional<Duration> braked;    ///< until the first full brake
  std::optional<Duration> stopping;  ///< until the first command of speed 0
  int drives_after_brake = 0;        ///< commands with a speed after the first brake command
  bool pose_invalid = false;
  bool integrity_none = false;
  std::set<std::string> events;  ///< codes of WM
  std::string state;             ///< of BG, the newest
  std::string top;               ///< what `rcs top --once` prints at the end
};

class SilentSensors : public testing::Test {
 protected:
  enum class Fault { kKill, kStop, kSilence };

  /// @param source  of kSilence, as the simulator names it
  Seen run(Fault fault, const std::string& source) {
    std::uniform_real_distribution<double> later_s(0.0, 4.0);
    const double silent_from_s = 14.0 + later_s(random_);
    std::vector<std::string> arguments;
    if (fault == Fault::kSilence) {
      arguments = {"--silence", source, fmt::format("{:.2f}", silent_from_s), "1000"};
    }
    VehicleRun vehicle("", arguments);
    Seen seen;
    Stamp newest = Stamp::min();  // arrival of the source's newest message
    std::optional<Stamp> silent;
    std::string state;
    double commanded_mps = 0.0;  // before the silence
    const auto receive = [&](Stamp arrival) {
      newest = arrival;
      seen.drove = commanded_mps > kDrives_mps;
    };
    Bus* const bus = vehicle.bus();
    if (bus == nullptr) {
      ADD_FAILURE() << vehicle.trouble();
      return seen;
    }
    Tap<ins_t> ins(bus, channel::kIns, [&](const ins_t&, Stamp at) {
      if (source == "ins" || source == "all") receive(at);
    });
    Tap<gps_fix_t> gps(bus, channel::kGpsFix, [&](const gps_fix_t&, Stamp at) {
      if (source == "gps") receive(at);
    });
    Tap<odometry_t> wheels(bus, channel::kOdometry, [&](const odometry_t&, Stamp at) {
      if (source == "odometry") receive(at);
    });
    Tap<ladar_ranges_t> ladar(bus, channel::kLadarRanges, [&](const ladar_ranges_t&, Stamp at) {
      if (source == "ladar") receive(at);
    });
    Tap<status_t> status(bus, channel::kBgStatus,
                         [&](const status_t& m, Stamp) { state = m.state; });
    // WM reports a silence before this test detects it.
    std::vector<std::pair<Stamp, std::string>> reported;
    Tap<event_t> events(bus, channel::kWmEvent,
                        [&](const event_t& m, Stamp at) { reported.emplace_back(at, m.code); });
    Tap<nav_state_t> nav(bus, channel::kWmNavState, [&](const nav_state_t& m, Stamp) {
      if (silent && m.pose_valid == 0) seen.pose_invalid = true;
    });
    Tap<integrity_t> integrity(bus, channel::kWmIntegrity, [&](const integrity_t& m, Stamp) {
      if (silent && m.validity == integrity_t::VALID_NONE) seen.integrity_none = true;
    });
    Tap<drive_t> drives(bus, channel::kBgDrive, [&](const drive_t& m, Stamp at) {
      if (!silent) {
        commanded_mps = m.speed_mps;
        return;
      }
      if (m.brake != 0 && !seen.braked) seen.braked = at - *silent;
      if (m.speed_mps == 0.0 && !seen.stopping) seen.stopping = at - *silent;
      if (seen.braked && (m.brake == 0 || m.speed_mps != 0.0)) ++seen.drives_after_brake;
    });
    const auto drives_now = [&] { return commanded_mps > kDrives_mps && state == "DRIVING"; };
    EXPECT_TRUE(vehicle.run_until(vehicle.now() + kPatience, drives_now)) << vehicle.trouble();
    if (fault == Fault::kSilence) {
      const auto is_silent = [&] {
        // More than a period of the source.
        const Duration most = from_milliseconds(source == "gps" ? 700.0 : 220.0);
        return vehicle.now() - newest > most;
      };
      EXPECT_TRUE(vehicle.run_until(vehicle.now() + kPatience, is_silent)) << vehicle.trouble();
      silent = newest;
    } else {
      (void)vehicle.run_until(vehicle.now() + from_seconds(0.5 * later_s(random_)), {});
      (void)vehicle.run_until(vehicle.now() + kPatience, drives_now);
      vehicle.send_signal_to_sim(fault == Fault::kKill ? SIGKILL : SIGSTOP);
      silent = vehicle.now();
      seen.drove = commanded_mps > kDrives_mps;
    }
    (void)vehicle.run_until(*silent + kWatched, {});
    EXPECT_EQ(vehicle.trouble(), "");
    for (const auto& [at, code] : reported) {
      if (at > *silent) seen.events.insert(code);
    }
    seen.state = state;
    seen.top = top(&vehicle);
    if (fault == Fault::kStop) vehicle.send_signal_to_sim(SIGCONT);
    return seen;
  }

  /// A trial in which the vehicle happened to be slow, before an obstacle or at a change of
  /// direction, shows nothing and is repeated.
  Seen run_driving(Fault fault, const std::string& source) {
    Seen seen = run(fault, source);
    for (int k = 1; k < kVoid && !seen.drove; ++k) seen = run(fault, source);
    EXPECT_TRUE(seen.drove) << source;
    return seen;
  }

  /// A full brake within its time limit, held, reported, and displayed.
  void expect_dead_stop(Fault fault, const std::string& source, int otherwise) {
    const int times = number_from("RCS_DRILL_TIMES", otherwise);
    int good = 0;
    Duration worst{};
    for (int i = 0; i < times; ++i) {
      const Seen s = run_driving(fault, source);
      const bool in_time = s.braked && *s.braked <= kBrakeWithin;
      worst = std::max(worst, s.braked.value_or(Duration::max()));
      const bool shown = s.top.find("LOST") != std::string::npos &&
                         s.top.find("POSE INVALID") != std::string::npos;
      const bool ok = in_time && s.drives_after_brake == 0 && s.pose_invalid && s.integrity_none &&
                      s.events.count("input.none") == 1 && shown;
      good += ok ? 1 : 0;
      std::fprintf(stderr, "%2d: brake after %.3f s, %d drive commands after it, BG %s\n", i + 1,
                   s.braked ? seconds(*s.braked) : -1.0, s.drives_after_brake, s.state.c_str());
      EXPECT_TRUE(ok) << "pose invalid " << s.pose_invalid << ", integrity " << s.integrity_none
                      << ", event " << s.events.count("input.none") << ", top:\n"
                      << s.top;
    }
    std::printf("%d of %d: full brake commanded within 0.5 s and held; latest %.3f s\n", good,
                times, seconds(worst));
  }

  /// One source of several: reported; the vehicle stops where required and continues otherwise.
  void expect_named(const std::string& source, const std::string& code, const std::string& state) {
    const int times = number_from("RCS_DRILL_TIMES", 10);
    int good = 0;
    Duration worst{};
    for (int i = 0; i < times; ++i) {
      const Seen s = run_driving(Fault::kSilence, source);
      const bool stops = !state.empty();
      worst = std::max(worst, s.stopping.value_or(stops ? kWatched : Duration::zero()));
      const bool ok = s.events.count(code) == 1 &&
                      (stops ? s.stopping && *s.stopping < from_seconds(1.0) && s.state == state
                             : s.state.rfind("DRIVING", 0) == 0);
      good += ok ? 1 : 0;
      std::fprintf(stderr, "%2d: %s silent: no speed after %.3f s, BG %s\n", i + 1, source.c_str(),
                   s.stopping ? seconds(*s.stopping) : -1.0, s.state.c_str());
      EXPECT_TRUE(ok) << source << ", event " << s.events.count(code) << ", BG " << s.state;
    }
    std::printf("%d of %d: %s silent, named, %s; stop commanded after at most %.3f s\n", good,
                times, source.c_str(), state.empty() ? "drives on" : state.c_str(), seconds(worst));
  }

 private:
  static std::string top(VehicleRun* vehicle) {
    Result<cli::ChildProcess> started = cli::ChildProcess::start(
        std::string(std::getenv("RCS_BIN_DIR")) + "/rcs", {"top", "--once", "--listen", "1"});
    if (!started) return started.error().message;
    std::string text;
    const auto add = [&](std::string_view line) { text += std::string(line) + "\n"; };
    const auto ended = [&] {
      started->read_output(add);
      return started->collect().has_value();
    };
    (void)vehicle->run_until(vehicle->now() + from_seconds(10.0), ended);
    started->read_output(add);
    return text;
  }

  std::mt19937 random_{1};
};

TEST_F(SilentSensors, SimulatorKilled) { expect_dead_stop(Fault::kKill, "", 30); }
TEST_F(SilentSensors, SimulatorStopped) { expect_dead_stop(Fault::kStop, "", 10); }
TEST_F(SilentSensors, AllDriversSilent) { expect_dead_stop(Fault::kSilence, "all", 10); }
TEST_F(SilentSensors, Ins) { expect_named("ins", "input.ins", "INS_LOST"); }
TEST_F(SilentSensors, Ladar) { expect_named("ladar", "input.ladar", "LADAR_LOST"); }
TEST_F(SilentSensors, Gps) { expect_named("gps", "input.gps", ""); }
TEST_F(SilentSensors, Odometry) { expect_named("odometry", "input.odometry", ""); }

}  // namespace
}  // namespace rcs::live_faults

// An emergency stop during a drive, and then kill -9 of BG, of all nodes, of `rcs up`, or of
// gateway and BG after a stop over DDS, while the operator keeps commanding: no motion before the
// release. RCS_DRILL_TIMES: repetitions of each of the four, default 13.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/live_faults/live_fault.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kPatience = from_seconds(90.0);
constexpr Duration kToDrive = from_seconds(30.0);
constexpr Duration kWatch = from_seconds(3.0);  // after the vehicle could drive again
constexpr double kRest_mps = 0.02;
constexpr double kMoved_m = 0.1;  // of ground truth, after the vehicle has come to rest

enum class Kind { kKillBg, kKillAll, kRestartUp, kDds };

/// Messages between the echo of a stop and its release.
struct Watch {
  bool on = false;
  bool at_rest = false;
  Vec2 rest_world = Vec2::Zero();
  double moved_m = 0.0;
  int drives = 0;                 ///< BG_DRIVE
  int unbraked = 0;               ///< of them
  int statuses = 0;               ///< BG_STATUS
  int unstopped = 0;              ///< of them, in another state
  int gotos = 0;                  ///< BG_COMMAND
  Stamp drivable = Stamp::max();  ///< since then WM's state allows driving
};

/// One vehicle, stopped and released once.
class Trial {
 public:
  Trial() {
    Bus* const bus = drill_.run.bus();
    if (bus == nullptr) return;
    truths_.emplace(bus, channel::kSimTruth, [this](const truth_t& m, Stamp) { take(m); });
    drives_.emplace(bus, channel::kBgDrive, [this](const drive_t& m, Stamp) {
      if (!watch_.on) return;
      ++watch_.drives;
      if (m.brake != 1 || m.speed_mps != 0.0) ++watch_.unbraked;
    });
    statuses_.emplace(bus, channel::kBgStatus, [this](const status_t& m, Stamp) {
      if (!watch_.on) return;
      ++watch_.statuses;
      if (m.state != "EMERGENCY_STOP") ++watch_.unstopped;
    });
    commands_.emplace(bus, channel::kBgCommand, [this](const command_t& m, Stamp) {
      if (watch_.on && m.kind == command_t::KIND_GOTO) ++watch_.gotos;
    });
    nav_states_.emplace(bus, channel::kWmNavState, [this](const nav_state_t& m, Stamp arrival) {
      // Without a heading, which WM determines while driving, BG drives straight ahead, which needs
      // no frame world.
      const bool drivable = m.mode != nav_state_t::MODE_ALIGN && m.mode != nav_state_t::MODE_LOST &&
                            m.pose_valid != 0 && m.rolling_valid != 0;
      if (!drivable) watch_.drivable = Stamp::max();
      if (drivable) watch_.drivable = std::min(watch_.drivable, arrival);
    });
  }

  /// @return no motion before the release, and another state of BG after it
  bool run(Kind kind) {
    VehicleRun::use_loopback();
    const bool still = stop_and_release(kind);
    EXPECT_EQ(drill_.run.trouble(), "");
    EXPECT_EQ(drill_.safety.metrics().collisions, 0);
    return still;
  }
  [[nodiscard]] std::string summary() const {
    return fmt::format(
        "moved {:.3f} m, {} of {} drives unbraked, {} of {} statuses not EMERGENCY_STOP, {} GOTO "
        "rejected, then {}",
        watch_.moved_m, watch_.unbraked, watch_.drives, watch_.unstopped, watch_.statuses,
        watch_.gotos, after_release_);
  }

 private:
  void take(const truth_t& m) {
    if (!watch_.on) return;
    const Vec2 here(m.p_world_vehicle_m[0], m.p_world_vehicle_m[1]);
    if (!watch_.at_rest && std::hypot(m.v_world_mps[0], m.v_world_mps[1]) < kRest_mps) {
      watch_.at_rest = true;
      watch_.rest_world = here;
    }
    if (!watch_.at_rest) return;
    watch_.moved_m = std::max(watch_.moved_m, (here - watch_.rest_world).norm());
  }

  bool stop_and_release(Kind kind) {
    if (!drill_.run_until_well(kPatience)) return failed("the vehicle does not drive: ");
    if (!engage(kind)) return failed("the stop is not confirmed: ");
    watch_.on = true;
    std::map<std::string, int> pids;
    for (const std::string& node : disturbed(kind)) pids[node] = drill_.run.pid_of(node);
    if (kind == Kind::kRestartUp) drill_.run.restart_up();
    if (kind != Kind::kRestartUp) {
      for (const auto& [node, pid] : pids) drill_.run.send_signal(node, SIGKILL);
    }
    const auto back = [&] {
      return std::all_of(pids.begin(), pids.end(), [&](const auto& old) {
        return drill_.run.pid_of(old.first) != old.second;
      });
    };
    if (!drill_.run.run_until(drill_.run.now() + kPatience, back)) {
      return failed("not all nodes are back: ");
    }
    watch_.drivable = Stamp::max();
    // Until only the stop keeps the vehicle from driving, and some time longer.
    const auto watched = [&] {
      return watch_.at_rest && watch_.drivable != Stamp::max() &&
             drill_.run.now() - watch_.drivable > kWatch;
    };
    if (!drill_.run.run_until(drill_.run.now() + kPatience, watched)) {
      return failed("WM has no valid pose: ");
    }
    watch_.on = false;
    if (!release(kind)) return failed("the release is not confirmed: ");
    // After a restart at rest the planner may find no path, which is not caused by the stop.
    drill_.recovery.reset();
    const bool drives = drill_.run_until_well(kToDrive);
    after_release_ = drives ? "drives" : drill_.recovery.missing();
    return watch_.moved_m < kMoved_m && watch_.unbraked == 0 && watch_.unstopped == 0 &&
           watch_.drives > 0 && watch_.gotos > 0 && after_release_ != "BG is EMERGENCY_STOP";
  }

  bool engage(Kind kind) {
    if (kind != Kind::kDds) return go("--emergency-stop");
    if (!dds("stop")) return false;
    return drill_.run.run_until(drill_.run.now() + kPatience, [&] {
      return drill_.recovery.missing() == "BG is EMERGENCY_STOP";
    });
  }

  bool release(Kind kind) {
    // A restarted gateway has no record of operators: the stop is written again first.
    if (kind == Kind::kDds) return dds("stop") && dds("release");
    return go("--release");
  }

  bool go(const std::string& what) {
    return drill_.run.run_program("rcs", {"go", what, "--timeout", "30"}, kPatience) == 0;
  }

  bool dds(const std::string& what) {
    const std::string id = std::to_string(++command_id_);
    return drill_.run.run_program("dds_client", {"-v", "demo3", "-o", "alice", what, id, "1"},
                                  kPatience) == 0;
  }

  static std::vector<std::string> disturbed(Kind kind) {
    if (kind == Kind::kKillBg) return {"bg"};
    if (kind == Kind::kDds) return {"gateway", "bg"};
    return kNodes;
  }

  bool failed(const char* what) {
    ADD_FAILURE() << what << drill_.recovery.missing() << "; " << drill_.run.trouble();
    return false;
  }

  LiveFault drill_;
  Watch watch_;
  std::string after_release_ = "not released";
  std::int64_t command_id_ = 0;
  std::optional<Tap<truth_t>> truths_;
  std::optional<Tap<drive_t>> drives_;
  std::optional<Tap<status_t>> statuses_;
  std::optional<Tap<command_t>> commands_;
  std::optional<Tap<nav_state_t>> nav_states_;
};

void expect_no_motion(Kind kind, const char* name) {
  const int times = number_from("RCS_DRILL_TIMES", 13);
  int still = 0;
  for (int i = 0; i < times; ++i) {
    Trial trial;
    if (trial.run(kind)) ++still;
    std::fprintf(stderr, "%s %2d: %s\n", name, i + 1, trial.summary().c_str());
  }
  std::printf("%s: %d of %d: no motion before the release\n", name, still, times);
  EXPECT_EQ(still, times);
}

TEST(StopDrill, KillBg) { expect_no_motion(Kind::kKillBg, "kill -9 of bg"); }
TEST(StopDrill, KillAllNodes) { expect_no_motion(Kind::kKillAll, "kill -9 of all nodes"); }
TEST(StopDrill, RestartUp) { expect_no_motion(Kind::kRestartUp, "kill -9, restart of rcs up"); }
/// At rest for as long as WM needs to write all of its terrain.
TEST(StopDrill, TheTerrainAheadOutlivesUp) {
  LiveFault drill;
  const auto reported = [&drill](const char* text) {
    return std::any_of(drill.events.begin(), drill.events.end(),
                       [&](const std::string& e) { return e.find(text) != std::string::npos; });
  };
  ASSERT_TRUE(drill.run_until_well(kPatience)) << drill.recovery.missing();
  ASSERT_EQ(drill.run.run_program("rcs", {"go", "--emergency-stop", "--timeout", "30"}, kPatience),
            0);
  drill.run_for(from_seconds(10.0));
  drill.run.restart_up();
  EXPECT_TRUE(drill.run.run_until(drill.run.now() + kPatience, [&] {
    return reported("start with the terrain ahead") || reported("start without");
  }));
  EXPECT_TRUE(reported("start with the terrain ahead"));
  EXPECT_EQ(drill.run.trouble(), "");
}

TEST(StopDrill, StopOverDds) {
  expect_no_motion(Kind::kDds, "stop over DDS, kill -9 of gateway and bg");
}

}  // namespace
}  // namespace rcs::live_faults

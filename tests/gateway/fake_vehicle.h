#pragma once
// The messages that the gateway receives on a vehicle's bus: from a WM with a valid pose, and from
// a BG and a mission that execute commands.

#include <functional>
#include <memory>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/cycle_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/command_port.h"
#include "rcs/node/node.h"
#include "rcs/node/stop_latch.h"
#include "rcs/node/timeline/live_timeline.h"

namespace rcs::gateway::test {

class FakeVehicle {
 public:
  static constexpr Duration kPeriod = std::chrono::milliseconds(20);

  FakeVehicle();

  /// Runs the vehicle until `done`, evaluated every cycle, returns true, or for at most `limit`.
  /// @return whether `done` returned true
  bool run_until(const std::function<bool()>& done, Duration limit);
  void set_pose_valid(bool valid) { nav_state_.pose_valid = valid ? 1 : 0; }
  void run_for(Duration span) {
    (void)run_until([] { return false; }, span);
  }

  [[nodiscard]] Stamp now() const { return timeline_.now(); }
  /// Every command that BG has accepted, once.
  [[nodiscard]] const std::vector<command_t>& commands() const { return commands_; }
  [[nodiscard]] bool has_taken(std::int8_t kind) const;
  /// Every command that the mission has accepted, emergency stops included.
  [[nodiscard]] const std::vector<command_t>& tasks() const { return tasks_; }
  /// BG has a command that is still valid.
  [[nodiscard]] bool commanded() const;
  /// An emergency stop is latched.
  [[nodiscard]] bool stopped() const { return latch_.engaged(); }

 private:
  void cycle(Stamp now);

  StopSignals stop_;
  std::unique_ptr<LcmBus> bus_;
  LiveTimeline timeline_;
  Outbox<nav_state_t> nav_states_;
  Outbox<cycle_t> wm_cycles_;
  Subordinate bg_;
  Subordinate mission_;
  StopLatch latch_;  // in memory
  PeriodicClock clock_{kPeriod};
  nav_state_t nav_state_{};
  cycle_t wm_cycle_{};
  std::vector<command_t> commands_;
  std::vector<command_t> tasks_;
};

}  // namespace rcs::gateway::test

#pragma once
// A run with its judges.

#include <deque>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "rcs/node/bus/tap.h"
#include "tests/live_faults/count_judge.h"
#include "tests/live_faults/recovery.h"
#include "tests/live_faults/safety_judge.h"
#include "tests/live_faults/vehicle_run.h"

namespace rcs::live_faults {

/// A number from the environment, such as RCS_DRILL_TIMES.
[[nodiscard]] int number_from(const char* variable, int otherwise);

/// Resident memory of a process [MB].
[[nodiscard]] double resident_mb(int pid);

// What a flood of messages may cost.
inline constexpr double kFloodMemory_mb = 80.0;  ///< growth of a process: 64 MB are its queue
inline constexpr double kFloodCycles = 0.9;      ///< share of the drive commands that BG publishes

struct LiveFault {
  explicit LiveFault(const std::string& vehicle_toml = "",
                     const std::vector<std::string>& sim_arguments = {});
  LiveFault(const LiveFault&) = delete;
  LiveFault& operator=(const LiveFault&) = delete;
  /// After a failure the output of the processes is kept.
  ~LiveFault();

  /// Runs until the vehicle drives with all nodes healthy, or until the time is over.
  bool run_until_well(Duration most);
  void run_for(Duration time) { (void)run.run_until(run.now() + time, {}); }
  /// All violations so far, as lines of text.
  [[nodiscard]] std::string breaches() const;

  VehicleRun run;
  SafetyJudge safety{SafetyLimits{}};
  /// Ground truth and belief differ: a waypoint that BG has reached counts even a little outside
  /// its radius.
  CountJudge counts{course_world(), kRadius_m + 1.0};
  Recovery recovery;
  std::deque<std::string> events;  ///< the newest events of the nodes

 private:
  void look();

  std::deque<Tap<cycle_t>> cycles_;
  std::deque<Tap<process_t>> processes_;
  std::deque<Tap<event_t>> events_;
  std::deque<Tap<truth_t>> truths_;
  std::deque<Tap<drive_t>> drives_;
  std::deque<Tap<nav_state_t>> nav_states_;
  std::deque<Tap<command_t>> commands_;
  std::deque<Tap<status_t>> statuses_;
  std::deque<Tap<registration_t>> registrations_;
  std::deque<Tap<innovation_t>> innovations_;
};

}  // namespace rcs::live_faults

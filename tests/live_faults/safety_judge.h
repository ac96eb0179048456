#pragma once
// Checks that the vehicle is stopped or drives safely, from the simulator's ground truth and from
// the inputs of the drive commands. Pure.

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "rcs/base/stamp.h"

namespace rcs::live_faults {

struct SafetyLimits {
  double speed_mps = 6.5;          ///< the operator's 6 and the overshoot of the controller
  double lateral_mps2 = 4.0;       ///< mean over half a second; BG plans with 2, wet grass allows 4
  double deceleration_mps2 = 6.0;  ///< mean over 0.2 s; the brake gives 5
  double moving_mps = 0.3;         ///< slower counts as standing
  /// From the end of a drive command to the first deceleration. The actuators take 60 ms, the
  /// mean of the deceleration 200 ms, the rest is the latency of the simulator.
  Duration until_braking = from_milliseconds(500.0);
  /// BG drives on no older input: its limit and two of its cycles.
  Duration nav_age = from_milliseconds(200.0 + 100.0);
  Duration ladar_age = from_milliseconds(500.0 + 100.0);
};

/// Observations since the last reset().
struct SafetyMetrics {
  int collisions = 0;  ///< number of times that the clearance fell to 0
  double clearance_m = 1e3;
  double speed_mps = 0.0;
  double deceleration_mps2 = 0.0;
  double lateral_mps2 = 0.0;
  double driven_m = 0.0;
  Duration longest_stand{};
};

class SafetyJudge {
 public:
  explicit SafetyJudge(const SafetyLimits& limits) : limits_(limits) {}

  void take(const truth_t& m, Stamp arrival);
  void take(const drive_t& m);
  void take(const nav_state_t& m);
  void take(const command_t& m);

  [[nodiscard]] double speed_mps() const { return samples_.empty() ? 0.0 : samples_.back().speed; }
  /// Resets the statistics.
  void reset();
  [[nodiscard]] const SafetyMetrics& metrics() const { return metrics_; }
  /// Violations as text; never more than a few of a kind.
  [[nodiscard]] const std::vector<std::string>& breaches() const { return breaches_; }

 private:
  struct Sample {
    std::int64_t utime;
    double speed, lateral, x, y;
  };
  void judge_motion(Stamp node_time);
  void breach(const std::string& kind, std::int64_t utime, const std::string& text);
  /// Newest sample that is older than the newest one by at least this time; null: none.
  [[nodiscard]] const Sample* before(Duration span) const;

  SafetyLimits limits_;
  SafetyMetrics metrics_;
  std::vector<std::string> breaches_;
  std::string last_kind_;
  std::int64_t last_breach_utime_ = 0;
  std::deque<Sample> samples_;  // of the last half second
  bool touching_ = false;
  std::optional<Duration> shift_;  // node time minus stamp of the ground truth; minimum observed
  std::optional<std::int64_t> stands_since_;
  std::optional<drive_t> drive_;
  std::int64_t nav_utime_ = 0;  // node time
  std::int64_t ladar_age_us_ = -1;
  std::int64_t ordered_until_utime_ = 0;
};

}  // namespace rcs::live_faults

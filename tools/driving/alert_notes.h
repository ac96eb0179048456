#pragma once
// What a closed-loop drive has to do with the alert limits of its task: beyond one of them the
// vehicle must stand, and from half of it on be slower.

#include <array>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "modules/vj/traversal_cost.h"
#include "rcs/node/bus/tap.h"

namespace rcs::driving {

struct AlertOutcome {
  int crossings = 0;        ///< of a limit, by a vehicle that moved
  int late = 0;             ///< of these: it drove farther than it needs to stop
  double beyond_m = 0.0;    ///< longest way driven beyond a limit
  double beyond_s = 0.0;    ///< time beyond a limit
  double slowed_s = 0.0;    ///< time between half of a limit and the limit
  double too_fast_s = 0.0;  ///< of both: with a drive command faster than the levels allow
};

/// Records a run from its bus. Levels are those in the frame of the command that BG executes: of
/// WM_INTEGRITY, or in frames local and rolling those relative to the rolling map.
class AlertNotes {
 public:
  /// @param frame  until BG is commanded to drive, command_t::FRAME_*
  /// @param limits  of the vehicle: alert limits, which a command can make narrower, and least
  ///   share of the speed
  /// @param task_mps  speed of the waypoints until then
  /// @param braking_mps2  planned deceleration
  AlertNotes(Bus* bus, std::int8_t frame, const vj::SpeedParams& limits, double task_mps,
             double braking_mps2);
  [[nodiscard]] const AlertOutcome& outcome() const { return outcome_; }

 private:
  void accept(const command_t& m);
  void accept(const integrity_t& m);
  void accept(const nav_state_t& m);
  void take_levels(double horizontal_m, double vertical_m);
  void accept(const truth_t& m);
  void accept(const drive_t& m);
  /// Largest of the last shares: BG plans four times a second.
  [[nodiscard]] double allowed_share() const;

  bool in_world_;
  vj::SpeedParams vehicle_;
  vj::SpeedParams limits_;  // of the command
  double task_mps_;
  double braking_mps2_;
  AlertOutcome outcome_;
  std::array<double, 8> shares_{};  // a ring; WM publishes ten a second
  std::size_t count_ = 0;
  std::int64_t truth_utime_ = 0;
  std::int64_t nav_utime_ = 0;  // of the newest levels
  bool beyond_ = false;
  bool is_late_ = false;
  double way_m_ = 0.0;
  double began_mps_ = 0.0;
  Tap<command_t> commands_;
  Tap<integrity_t> levels_;
  Tap<nav_state_t> nav_states_;
  Tap<truth_t> truth_;
  Tap<drive_t> drive_;
};

}  // namespace rcs::driving

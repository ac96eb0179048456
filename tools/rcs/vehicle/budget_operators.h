#pragma once
// Who commands the live nodes while `rcs budget` plays a log to them.

#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"
#include "rcs/node/command_port.h"

namespace rcs::cli {

/// Keeps BG planning as during a drive: sends a goal ahead of the vehicle and, when that is near,
/// the next one. The recorded motion does not depend on BG.
class BudgetOperator {
 public:
  explicit BudgetOperator(Bus* bus);
  void take(const nav_state_t& m);
  void step(Stamp now);

 private:
  CommandPort port_;
  Pose T_local_vehicle_;
  Vec3 goal_ = Vec3::Zero();
  rcs::Command command_;
  Stamp next_send_ = Stamp::min();
};

/// The same for the mission, which then commands BG: visits places around the vehicle, and another
/// task from time to time, so that routes are searched and BG plans along them. Places that the
/// mission refuses, or finds no route to, are replaced by nearer ones.
class BudgetMission {
 public:
  explicit BudgetMission(Bus* bus);
  void take(const nav_state_t& m);
  void step(Stamp now);

 private:
  CommandPort port_;
  bool world_known_ = false;
  Pose T_world_vehicle_;
  double around_m_;
  rcs::Command task_;
  Stamp next_task_ = Stamp::min();
  Stamp next_send_ = Stamp::min();
};

}  // namespace rcs::cli

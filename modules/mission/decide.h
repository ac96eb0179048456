#pragma once
// What the vehicle level does: one table from the facts of a cycle to an action.

#include <string_view>

#include "rcs/base/stamp.h"

namespace rcs::mission {

enum class TaskKind { kNone, kHold, kVisit, kFollow, kReturn, kUnknown };

/// Of the route of the task.
enum class RouteState {
  kNone,       ///< not searched yet
  kSearching,  ///< candidates are searched, or WM predicts the uncertainty along them
  kChosen,
  kImpossible  ///< none keeps the limits, or none exists
};

/// What happens to the task when its operator has not renewed it.
enum class OperatorLoss { kContinue, kHold, kReturn };

struct Facts {
  TaskKind task = TaskKind::kNone;
  std::string_view cannot;         ///< why the task cannot be executed; empty: it can
  bool operator_received = false;  ///< the task is still valid
  Duration wm_age = Duration::max();
  Duration bg_age = Duration::max();
  bool emergency_stop = false;  ///< latched by BG
  bool pose_valid = false;
  bool world_known = true;  ///< the pose in frame world
  /// Protection level over the alert limit of the task: of the position in frame world, and of that
  /// relative to the own map.
  double world_level = 0.0;
  double own_map_level = 0.0;
  Duration above_limit{};   ///< for how long world_level has been above 1
  bool gps = true;          ///< received and accepted
  bool can_return = false;  ///< the way back is known
  bool returning = false;   ///< instead of the task, since an earlier cycle
  RouteState route = RouteState::kNone;
  bool bg_no_path = false;  ///< BG has found no path along the route
  int blocked = 0;          ///< times that this has happened for this task
  bool arrived = false;     ///< the last place of the route
};

struct DecideParams {
  Duration wm_silence = from_milliseconds(500.0);
  Duration bg_silence = from_milliseconds(500.0);
  Duration patience = from_seconds(10.0);  ///< above the alert limit, before the vehicle returns
  int most_blocked = 5;                    ///< new routes because of blocked ones
  OperatorLoss operator_loss = OperatorLoss::kContinue;
};

enum class Action {
  kNone,        ///< BG is not commanded
  kHalt,        ///< BG is commanded to halt
  kSearch,      ///< the same, while the route is searched
  kInitialize,  ///< BG is sent to the first place: it drives ahead until the heading is known
  kReplan,      ///< the blocked place is excluded, and the route is searched again
  kDrive,       ///< along the route
  kReturn,      ///< along the way back
};

enum class Status { kUninitialized, kExecuting, kDone, kError };

struct Decision {
  Action action = Action::kHalt;
  Status status = Status::kUninitialized;
  std::string_view state;   ///< for the superior; stable
  std::string_view reason;  ///< literals, or Facts::cannot
  int line = 0;             ///< of the row in decide.cpp
};

[[nodiscard]] Decision decide(const Facts& facts, const DecideParams& params);

}  // namespace rcs::mission

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

/// An error that BG reports of the route that it was sent. Of its other errors, an emergency stop
/// is a fact of its own, and an expired command is renewed.
enum class BgError {
  kNone,
  kNoPath,    ///< no path is found along the route
  kRejected,  ///< the route cannot be executed
  kZone       ///< the vehicle is in forbidden ground or near to it, and no path leads out
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
  BgError bg_error = BgError::kNone;
  std::string_view bg_reason;  ///< of the error
  Duration bg_error_for{};     ///< for how long BG has reported it
  /// Why BG, which executes the route, keeps the vehicle at rest until it ends by itself, for
  /// example without the LADAR; empty: it does not.
  std::string_view bg_waits;
  bool bg_on_task_route = true;  ///< not on the way back, and not to initialize the heading
  int blocked = 0;               ///< routes of this task without a path
  /// BG has rejected a route of this task before, or executed this one: it has ended its task.
  bool rejected_for_good = false;
  bool arrived = false;  ///< the last place of the route of the task, or of the way back
};

struct DecideParams {
  Duration wm_silence = from_milliseconds(500.0);
  Duration bg_silence = from_milliseconds(500.0);
  Duration patience = from_seconds(10.0);  ///< above the alert limit, before the vehicle returns
  /// In an error of BG to which there is no other route: it ends by itself, or the task fails.
  Duration bg_patience = from_seconds(10.0);
  int max_blocked = 5;  ///< new routes because of blocked ones
  OperatorLoss operator_loss = OperatorLoss::kContinue;
};

enum class Action {
  kNone,        ///< BG is not commanded
  kHalt,        ///< BG is commanded to halt
  kSearch,      ///< the same, while the route is searched
  kInitialize,  ///< BG is sent to the first place: it drives ahead until the heading is known
  kReplan,      ///< the blocked place is excluded, and the route is searched again
  kRestart,     ///< the route that BG has rejected is dropped, and begins again
  kDrive,       ///< along the route
  kReturn,      ///< along the way back
};

enum class Status { kUninitialized, kExecuting, kDone, kError };

struct Decision {
  Action action = Action::kHalt;
  Status status = Status::kUninitialized;
  std::string_view state;   ///< for the superior; stable
  std::string_view reason;  ///< literals, Facts::cannot or Facts::bg_reason
  int line = 0;             ///< of the row in decide.cpp
};

[[nodiscard]] Decision decide(const Facts& facts, const DecideParams& params);

}  // namespace rcs::mission

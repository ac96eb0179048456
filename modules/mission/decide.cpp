#include "modules/mission/decide.h"

namespace rcs::mission {

// The first row whose condition holds decides. The rows are in order of danger; BG keeps its own
// table below this one, and stops the vehicle whatever is commanded here.
Decision decide(const Facts& f, const DecideParams& p) {
  const auto row = [](int line, Action action, Status status, std::string_view state,
                      std::string_view reason) {
    return Decision{action, status, state, reason, line};
  };
  const auto moving = [&](int line, Action action, std::string_view state,
                          std::string_view reason) {
    return f.bg_waits.empty() ? row(line, action, Status::kExecuting, state, reason)
                              : row(line, action, Status::kExecuting, "BG_WAITING", f.bg_waits);
  };

  // -- no task ------------------------------------------------------------------------------------
  if (f.task == TaskKind::kNone) {
    return row(__LINE__, Action::kNone, Status::kUninitialized, "IDLE", "");
  }
  if (f.task == TaskKind::kHold) {
    return row(__LINE__, Action::kHalt, Status::kDone, "HOLDING", "");
  }
  if (f.emergency_stop) {
    return row(__LINE__, Action::kHalt, Status::kError, "EMERGENCY_STOP",
               "an emergency stop is latched; it ends the task");
  }
  if (f.task == TaskKind::kUnknown || !f.cannot.empty()) {
    return row(__LINE__, Action::kHalt, Status::kError, "REFUSED",
               f.cannot.empty() ? "command rejected: its kind is unknown" : f.cannot);
  }
  if (f.arrived && !f.returning) {
    return row(__LINE__, Action::kHalt, Status::kDone, "ARRIVED", "");
  }

  // -- contingencies ------------------------------------------------------------------------------
  if (f.bg_age > p.bg_silence) {
    return row(__LINE__, Action::kHalt, Status::kExecuting, "BG_SILENT",
               "waiting because behavior generation is silent");
  }
  if (f.wm_age > p.wm_silence) {
    return row(__LINE__, Action::kHalt, Status::kExecuting, "WM_SILENT",
               "waiting because the world model is silent");
  }
  if (!f.pose_valid) {
    return row(__LINE__, Action::kHalt, Status::kExecuting, "POSE_INVALID",
               "waiting because the world model has no valid pose");
  }
  if (!f.operator_received && p.operator_loss == OperatorLoss::kHold) {
    return row(__LINE__, Action::kHalt, Status::kExecuting, "OPERATOR_LOST",
               "waiting because the task was not renewed");
  }

  // -- BG cannot execute the route: the error stays until another task ----------------------------
  const bool persists = f.bg_error_for > p.bg_patience;
  if (f.bg_error == BgError::kRejected && f.rejected_for_good) {
    return row(__LINE__, Action::kHalt, Status::kError, "REFUSED", f.bg_reason);
  }
  if (f.bg_error == BgError::kRejected) {
    return row(__LINE__, Action::kRestart, Status::kExecuting, "PLANNING",
               "the route begins again because behavior generation has rejected it");
  }
  if (f.bg_error == BgError::kZone && persists) {
    return row(__LINE__, Action::kHalt, Status::kError, "ZONE", f.bg_reason);
  }
  if (f.bg_error == BgError::kNoPath && !f.bg_on_task_route && persists) {
    return row(__LINE__, Action::kHalt, Status::kError, "BLOCKED",
               "no path on the way back, or ahead to initialize the heading");
  }

  // -- the way back -------------------------------------------------------------------------------
  const bool may_return = f.can_return && f.own_map_level <= 1.0;
  const bool operator_returns = !f.operator_received && p.operator_loss == OperatorLoss::kReturn;
  if ((f.returning || operator_returns) && f.arrived) {
    return row(__LINE__, Action::kHalt, Status::kError, "RETURNED",
               "back at the start of the way; the task is not completed");
  }
  if ((f.returning || operator_returns) && may_return) {
    return moving(__LINE__, Action::kReturn, "RETURNING",
                  operator_returns ? "returning because the task was not renewed"
                                   : "returning because the task cannot be continued");
  }
  if (operator_returns || f.returning) {
    return row(__LINE__, Action::kHalt, Status::kExecuting, "CANNOT_RETURN",
               "waiting because the way back, or the position on it, is not known");
  }
  if (f.task == TaskKind::kReturn) {
    if (!f.can_return) {
      return row(__LINE__, Action::kHalt, Status::kError, "REFUSED",
                 "command rejected: no way back is known");
    }
    if (!may_return) {
      return row(__LINE__, Action::kHalt, Status::kExecuting, "CANNOT_RETURN",
                 "waiting because the position on the way back is not known");
    }
    return moving(__LINE__, Action::kReturn, "RETURNING", "");
  }
  if (!f.world_known) {
    return moving(__LINE__, Action::kInitialize, "INITIALIZING_HEADING",
                  "driving slowly ahead to initialize the heading of the world model");
  }
  if (f.above_limit > p.patience && may_return) {
    return moving(__LINE__, Action::kReturn, "RETURNING",
                  "returning because the protection level is above the alert limit of the task");
  }
  if (f.world_level > 1.0) {
    return row(__LINE__, Action::kHalt, Status::kExecuting, "ABOVE_ALERT_LIMIT",
               "waiting because the protection level is above the alert limit of the task");
  }

  // -- the route ----------------------------------------------------------------------------------
  if (f.route == RouteState::kImpossible && !f.gps && may_return) {
    return moving(__LINE__, Action::kReturn, "RETURNING",
                  "returning because without GPS no route keeps the alert limit of the task");
  }
  if (f.route == RouteState::kImpossible) {
    return row(__LINE__, Action::kHalt, Status::kError, "NO_ROUTE",
               "no route exists, or none keeps the limits of the task");
  }
  const bool blocked = f.bg_error == BgError::kNoPath && f.bg_on_task_route;
  if (blocked && f.blocked >= p.max_blocked) {
    return row(__LINE__, Action::kHalt, Status::kError, "BLOCKED",
               "the routes that were tried are blocked");
  }
  if (blocked) {
    return row(__LINE__, Action::kReplan, Status::kExecuting, "PLANNING",
               "another route is searched because this one is blocked");
  }
  if (f.route != RouteState::kChosen) {
    return row(__LINE__, Action::kSearch, Status::kExecuting, "PLANNING",
               "routes are searched and simulated");
  }
  return moving(__LINE__, Action::kDrive, f.gps ? "DRIVING" : "DRIVING_NO_GPS", "");
}

}  // namespace rcs::mission

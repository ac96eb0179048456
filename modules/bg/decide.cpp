#include "modules/bg/decide.h"

#include <cmath>

namespace rcs::bg {

// The first row whose condition holds decides. The rows are in order of danger.
Decision decide(const Facts& f, bool emergency, const DecideParams& p) {
  const bool at_rest = std::abs(f.speed_mps) < p.rest_mps;
  const bool releases = f.command == CommandKind::kRelease && f.command_is_valid;
  // The speed of a pose whose sensor time stands still is outdated.
  const bool speed_known =
      f.nav_age <= p.nav_silence && f.nav_still <= p.nav_still && f.pose_valid && f.aligned;
  const bool known_at_rest = at_rest && speed_known;
  if (f.command == CommandKind::kEmergencyStop) emergency = true;
  // Only in its cycle: a rejected release must not take effect once the vehicle is at rest.
  const bool release = emergency && releases && f.command_is_new && known_at_rest;

  const auto row = [&](int line, Action action, Status status, std::string_view state,
                       std::string_view reason) {
    return Decision{action, status, state, reason, line, emergency, release};
  };
  const Status when_at_rest = at_rest ? Status::kDone : Status::kExecuting;

  // -- the emergency stop: latched until it is released, whatever is commanded --------------------
  if (emergency && f.command == CommandKind::kEmergencyStop) {
    return row(__LINE__, Action::kBrake, when_at_rest, "EMERGENCY_STOP", "");
  }
  // Of an outdated or invalid pose no speed is known.
  if (emergency && releases && !speed_known) {
    return row(__LINE__, Action::kBrake, Status::kError, "EMERGENCY_STOP",
               "release rejected: the world model is silent or has no valid pose, so rest is not "
               "confirmed");
  }
  if (emergency) {
    return row(__LINE__, Action::kBrake, Status::kError, "EMERGENCY_STOP",
               "command rejected: an emergency stop is latched; release it at rest first");
  }

  // -- no command to drive ------------------------------------------------------------------------
  if (f.command == CommandKind::kNone) {
    return row(__LINE__, Action::kStop, Status::kUninitialized, "IDLE", "");
  }
  if (f.command == CommandKind::kHalt) {
    return row(__LINE__, Action::kStop, when_at_rest, "HALT", "");
  }
  if (f.command == CommandKind::kRelease) {
    return row(__LINE__, Action::kStop, Status::kDone, "RELEASED", "");
  }
  if (f.command == CommandKind::kUnknown || !f.cannot.empty()) {
    return row(__LINE__, Action::kStop, Status::kError, "REJECTED",
               f.cannot.empty() ? "command rejected: its kind is unknown" : f.cannot);
  }
  if (f.arrived) {
    return row(__LINE__, Action::kStop, when_at_rest, "ARRIVED", "");
  }
  if (!f.command_is_valid) {
    return row(__LINE__, Action::kStop, Status::kError, "COMMAND_EXPIRED",
               "command expired: no new one was received");
  }

  // -- contingencies: loss of an input, and the least risk that remains ---------------------------
  const bool no_ladar = f.ladar_age > p.ladar_loss;
  const bool no_gps = f.gps_age > p.gps_loss;
  if (f.supervisor_silent) {
    return row(__LINE__, Action::kBrake, Status::kExecuting, "SUPERVISOR_SILENT",
               "waiting because rcs up, which restarts the nodes, is silent");
  }
  if (f.second_publisher) {
    return row(__LINE__, Action::kBrake, Status::kExecuting, "SECOND_PUBLISHER",
               "waiting because a second program publishes what BG drives by");
  }
  if (f.nav_age > p.nav_silence) {
    return row(__LINE__, Action::kBrake, Status::kExecuting, "WM_SILENT",
               "waiting because the world model is silent");
  }
  if (f.nav_still > p.nav_still) {
    return row(__LINE__, Action::kBrake, Status::kExecuting, "POSE_FROZEN",
               "waiting because the sensor time of the pose stands still");
  }
  if (f.integrity_age > p.integrity_silence) {
    return row(__LINE__, Action::kBrake, Status::kExecuting, "INTEGRITY_SILENT",
               "waiting because the world model publishes no integrity");
  }
  if (!f.pose_valid) {
    return row(__LINE__, Action::kBrake, Status::kExecuting, "POSE_INVALID",
               "waiting because the world model has no valid pose");
  }
  if (!f.aligned) {
    return row(__LINE__, Action::kBrake, Status::kExecuting, "NOT_LOCALIZED",
               "waiting because the world model is in alignment or lost");
  }
  if (no_ladar && no_gps) {
    return row(__LINE__, Action::kBrake, Status::kExecuting, "LADAR_AND_GPS_LOST",
               "waiting because neither LADAR nor GPS is received");
  }
  const bool leaves_zone =
      (f.zone == ZoneState::kNear || f.zone == ZoneState::kInside) && f.leads_out && f.has_path;
  if (f.zone == ZoneState::kInside && !leaves_zone) {
    return row(__LINE__, Action::kBrake, Status::kError, "ZONE", f.zone_reason);
  }
  const bool may_move = f.ins_age <= p.ins_loss && f.map_age <= p.map_loss && f.speed_share > 0.0 &&
                        (f.zone == ZoneState::kFree || leaves_zone);
  if (no_ladar && f.leads_back && f.has_path && may_move) {
    return row(__LINE__, Action::kDrive, Status::kExecuting, "BACKING_OUT",
               "backing over the driven ground because no scan can be registered here");
  }
  if (no_ladar) {
    return row(__LINE__, Action::kStop, Status::kExecuting, "LADAR_LOST",
               "waiting because no LADAR scan was registered recently");
  }
  if (f.ins_age > p.ins_loss) {
    return row(__LINE__, Action::kStop, Status::kExecuting, "INS_LOST",
               "waiting because the INS is lost");
  }
  if (f.map_age > p.map_loss) {
    return row(__LINE__, Action::kStop, Status::kExecuting, "MAP_OLD",
               "waiting because the terrain has no recent scan");
  }
  if (f.speed_share <= 0.0) {
    return row(__LINE__, Action::kStop, Status::kExecuting, "POSE_UNCERTAIN",
               "waiting because the pose is too uncertain to drive");
  }

  // -- the operating zones ------------------------------------------------------------------------
  if (f.zone == ZoneState::kUnknown) {
    return row(__LINE__, Action::kStop, Status::kExecuting, "ZONE_POSE_UNKNOWN", f.zone_reason);
  }
  if (f.zone == ZoneState::kUnbounded) {
    return row(__LINE__, Action::kStop, Status::kExecuting, "ZONE_POSE_UNCERTAIN", f.zone_reason);
  }
  if (f.zone == ZoneState::kNear && !leaves_zone) {
    return row(__LINE__, Action::kStop, Status::kError, "ZONE", f.zone_reason);
  }

  if (f.leads_back && f.has_path) {
    return row(__LINE__, Action::kDrive, Status::kExecuting, "BACKING_OUT",
               "backing over the driven ground because the vehicle stands in an obstacle");
  }

  // -- the path -----------------------------------------------------------------------------------
  if (!f.has_path && f.without_path > p.patience) {
    return row(__LINE__, Action::kStop, Status::kError, "NO_PATH",
               "no path to the waypoint was found");
  }
  if (!f.has_path) {
    return row(__LINE__, Action::kStop, Status::kExecuting, "PLANNING", "searching for a path");
  }
  if (leaves_zone) {
    return row(__LINE__, Action::kDrive, Status::kExecuting, "LEAVING_ZONE", f.zone_reason);
  }
  if (!f.north_known) {
    return row(__LINE__, Action::kDrive, Status::kExecuting, "INITIALIZING_HEADING",
               "driving slowly ahead to initialize the heading of the world model");
  }
  return row(__LINE__, Action::kDrive, Status::kExecuting, no_gps ? "DRIVING_NO_GPS" : "DRIVING",
             "");
}

}  // namespace rcs::bg

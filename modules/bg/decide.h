#pragma once
// The state table of BG: maps the command, the health of the inputs and the state of the path to an
// action. Pure: the same facts give the same decision. For every loss of an input there is a row
// that ends at rest.

#include <string_view>

#include "rcs/base/stamp.h"

namespace rcs::bg {

enum class CommandKind { kNone, kHalt, kGoto, kEmergencyStop, kRelease, kUnknown };

/// The vehicle and what the operating zones forbid.
enum class ZoneState {
  kFree,       ///< farther away than the bound of the position error, or nothing is forbidden
  kUnknown,    ///< the zones cannot be applied: the pose in frame world is unknown
  kUnbounded,  ///< no bound of the position error
  kNear,       ///< forbidden ground is within the bound
  kInside      ///< in forbidden ground
};

/// What BG knows in one cycle.
struct Facts {
  CommandKind command = CommandKind::kNone;  ///< newest command
  bool command_is_new = false;               ///< accepted in this cycle
  bool command_is_valid = false;             ///< it has not expired
  std::string_view cannot;                   ///< why its content cannot be executed; empty: it can
  double speed_mps = 0.0;                    ///< of the vehicle, if known
  Duration nav_age = Duration::max();        ///< since the newest navigation message
  Duration nav_still = Duration::max();      ///< since its sensor time last changed
  Duration integrity_age = Duration::max();  ///< since the newest integrity message
  bool pose_valid = false;                   ///< both messages have a valid pose
  bool supervisor_silent = false;            ///< `rcs up`, which restarts what fails
  bool second_publisher = false;             ///< of what BG drives by, within the last second
  bool aligned = false;                      ///< WM has an attitude and is not lost
  Duration ins_age{};                        ///< since an INS sample was last integrated; 0: no INS
  Duration ladar_age = Duration::max();      ///< since a registration was last fused
  Duration gps_age = Duration::max();
  Duration map_age = Duration::max();  ///< since the newest scan in the terrain
  bool north_known = true;             ///< WM knows the frame of the command
  double speed_share =
      0.0;  ///< share of the speed allowed by the pose and its protection levels in the frame of
            ///< the command (vj::speed_share(), vj::protected_share())
  bool arrived = false;     ///< within the last waypoint
  bool has_path = false;    ///< a path that is still valid
  Duration without_path{};  ///< time since the last valid path
  bool leads_back = false;  ///< the path leads back over the ground that was just driven over
  ZoneState zone = ZoneState::kFree;
  std::string_view zone_reason;  ///< names the zone, or why zones cannot be kept
  bool leads_out = false;        ///< the path leads out of forbidden ground, or away from it
};

struct DecideParams {
  Duration nav_silence = from_milliseconds(200.0);  ///< WM is silent
  Duration nav_still = from_milliseconds(300.0);    ///< its sensor time stands still
  Duration integrity_silence = from_milliseconds(500.0);
  Duration ins_loss = from_milliseconds(500.0);
  Duration ladar_loss = from_milliseconds(500.0);  ///< no scan registered
  Duration gps_loss = from_milliseconds(1500.0);
  Duration map_loss = from_milliseconds(1500.0);   ///< no scan in the terrain
  Duration patience = from_milliseconds(15000.0);  ///< without a path
  double rest_mps = 0.15;                          ///< a slower vehicle is at rest
};

enum class Action {
  kDrive,  ///< along the path
  kStop,   ///< along the path, gently: the terrain there is known
  kBrake,  ///< as fast as is safe, steering unchanged
};

enum class Status { kUninitialized, kExecuting, kDone, kError };

struct Decision {
  Action action = Action::kBrake;
  Status status = Status::kUninitialized;
  std::string_view state;  ///< for the superior; stable
  std::string_view
      reason;    ///< why the vehicle does not drive; literals, Facts::cannot or zone_reason
  int line = 0;  ///< of the row in decide.cpp
  bool emergency = false;  ///< an emergency stop is in force
  bool release = false;    ///< the command may end the stops that it names, in this cycle only
};

/// @param emergency  an emergency stop is latched
[[nodiscard]] Decision decide(const Facts& facts, bool emergency, const DecideParams& params);

}  // namespace rcs::bg

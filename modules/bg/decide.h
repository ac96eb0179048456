#pragma once
// The state table of BG: from the command, the health of what it rests on and the way ahead to what
// is done. Pure: the same facts give the same decision. Whatever is lost, there is a row that ends
// in standing still.

#include <string_view>

#include "rcs/base/stamp.h"

namespace rcs::bg {

enum class Order { kNone, kHalt, kGoto, kEmergencyStop, kRelease, kUnknown };

/// What BG knows in one cycle.
struct Facts {
  Order order = Order::kNone;                ///< newest command
  bool order_is_new = false;                 ///< accepted in this cycle
  bool order_is_valid = false;               ///< its time is not over
  std::string_view cannot;                   ///< why its content cannot be done; empty: it can
  double speed_mps = 0.0;                    ///< of the vehicle, as far as is known
  Duration nav_age = Duration::max();        ///< since the newest navigation message
  Duration nav_still = Duration::max();      ///< since its sensor time last changed
  Duration integrity_age = Duration::max();  ///< since the newest integrity message
  bool pose_valid = false;                   ///< both messages have a valid pose
  bool aligned = false;                      ///< WM has an attitude and is not lost
  Duration ins_age{};                        ///< since an INS sample was last integrated; 0: no INS
  Duration ladar_age = Duration::max();      ///< since a registration was last fused
  Duration gps_age = Duration::max();
  Duration map_age = Duration::max();  ///< since the newest scan in the terrain
  bool north_known = true;             ///< and so the frame of the command is
  double speed_share = 0.0;            ///< of the pose and its protection level in the command's
                                       ///< frame (vj::speed_share(), vj::protected_share())
  bool arrived = false;                ///< within the last waypoint
  bool has_way = false;                ///< a path that is still right
  Duration without_way{};              ///< for how long there has been none
};

struct DecideParams {
  Duration nav_silence = from_milliseconds(200.0);  ///< WM is silent
  Duration nav_still = from_milliseconds(300.0);    ///< its sensor time stands
  Duration integrity_silence = from_milliseconds(500.0);
  Duration ins_loss = from_milliseconds(500.0);
  Duration ladar_loss = from_milliseconds(500.0);  ///< nothing registered
  Duration gps_loss = from_milliseconds(1500.0);
  Duration map_loss = from_milliseconds(1500.0);   ///< the terrain is old
  Duration patience = from_milliseconds(15000.0);  ///< without a way
  double rest_mps = 0.15;                          ///< slower is at rest
};

enum class Action {
  kDrive,  ///< along the path
  kStop,   ///< along the path, gently: what lies there has been seen
  kBrake,  ///< as fast as is safe, wheels as they are
};

enum class Status { kUninitialized, kExecuting, kDone, kError };

struct Decision {
  Action action = Action::kBrake;
  Status status = Status::kUninitialized;
  std::string_view state;   ///< for the superior, stable
  std::string_view reason;  ///< why it does not drive on; literals, or Facts::cannot
  int line = 0;             ///< of the row in decide.cpp
  bool emergency = false;   ///< stays until it is released: the memory of the next cycle
};

/// @param emergency  Decision::emergency of the last cycle
[[nodiscard]] Decision decide(const Facts& facts, bool emergency, const DecideParams& params);

}  // namespace rcs::bg

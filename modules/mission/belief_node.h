#pragma once
// The newest belief of WM in the shell of the vehicle level.

#include <limits>
#include <optional>

#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "modules/mission/way_back.h"
#include "rcs/base/geodesy.h"
#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/report.h"

namespace rcs::mission {

struct Belief {
  Stamp arrival = Stamp::min();  ///< min: none yet
  bool pose_valid = false;
  bool world_valid = false;
  Pose T_world_vehicle;
  std::optional<Vec3> datum;  ///< of frame world: latitude, longitude [deg], height [m]
  Breadcrumb here;
  double own_map_m = 0.0;      ///< horizontal protection level relative to the rolling map
  double sigma_world_m = 0.0;  ///< worst horizontal direction
  double level_m = 0.0;        ///< horizontal protection level in frame world; infinite: none
  Duration gps_age = Duration::max();
};

/// @param datum_deg  latitude, longitude [deg], height [m]; plausible, as that of Belief
[[nodiscard]] LocalFrame frame_at(const Vec3& datum_deg);

class BeliefInput {
 public:
  explicit BeliefInput(Bus* bus);

  /// Accepts what has arrived.
  /// @param notes_way  the vehicle drives where its way back will lead
  /// @param way  positions in frame world are converted when another frame world begins
  void take(Stamp now, bool notes_way, WayBack* way, Report* report);

  [[nodiscard]] const Belief& newest() const { return belief_; }
  /// The last take() received the first datum, or another one.
  [[nodiscard]] bool datum_is_new() const { return datum_is_new_; }
  /// From the frame world before the last take() to that of now; the identity with the first datum.
  [[nodiscard]] const Pose& T_world_before() const { return T_world_before_; }
  [[nodiscard]] const InboxBase& nav_inbox() const { return nav_states_; }
  [[nodiscard]] const InboxBase& integrity_inbox() const { return integrities_; }

 private:
  void take_datum(const Vec3& datum_deg, WayBack* way);

  Inbox<nav_state_t> nav_states_;
  Inbox<integrity_t> integrities_;
  Belief belief_;
  bool datum_is_new_ = false;
  Pose T_world_before_;
};

}  // namespace rcs::mission

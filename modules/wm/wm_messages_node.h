#pragma once
// The door: what is not finite, plausible and meant to be used does not get in.

#include <optional>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "modules/wm/estimator.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/report.h"

namespace rcs::wm {

/// A registration_t's answer, whichever its target.
struct Registration {
  Pose T_target_vehicle;
  Mat6 information;
  std::int64_t tile_id = 0;  ///< the first; 0: none
};

[[nodiscard]] std::optional<ImuSample> admit(const ins_t& m);
/// With sigmas that the kind of solution and the satellites allow.
[[nodiscard]] std::optional<GeodeticFix> admit(const gps_fix_t& m);
[[nodiscard]] std::optional<OdometrySample> admit(const odometry_t& m);
[[nodiscard]] std::optional<Registration> admit(const registration_t& m);

/// An event when it was not let in.
void tell_refused(const InboxBase& inbox, Reason reason, Stamp now, Report* report);

}  // namespace rcs::wm

#pragma once
// Input validation: rejects messages that are not finite, not plausible or not meant to be used.

#include <optional>
#include <string_view>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/odometry_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "modules/wm/estimator.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/report.h"

namespace rcs::wm {

/// The result in a registration_t, for either target.
struct Registration {
  Pose T_target_vehicle;
  Mat6 information;
  std::int64_t tile_id = 0;  ///< the first; 0: none
};

[[nodiscard]] std::optional<ImuSample> admit(const ins_t& m);
/// The standard deviations are at least those that the solution and the satellites allow.
[[nodiscard]] std::optional<GeodeticFix> admit(const gps_fix_t& m);
[[nodiscard]] std::optional<OdometrySample> admit(const odometry_t& m);
[[nodiscard]] std::optional<Registration> admit(const registration_t& m);

/// Reports an event if the message was rejected.
void report_rejected(const InboxBase& inbox, Reason reason, Stamp now, Report* report);
/// Reports that the message was rejected.
void report_rejected(const InboxBase& inbox, std::string_view reason, Stamp now, Report* report);

}  // namespace rcs::wm

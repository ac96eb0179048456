#pragma once
// Which sources the belief lives on.

#include "modules/wm/filter.h"

namespace rcs::wm {

/// The values are nav_state_t's.
enum class Mode : int {
  kAlign = 0,
  kGpsIns = 1,
  kGpsInsLadar = 2,
  kInsLadar = 3,
  kInsDeadReckoning = 4,
  kGpsLadar = 5,  ///< GPS without INS; the LADAR's age says whether it takes part
  kLadar = 6,
  kLost = 7
};

/// Sensor time since the newest accepted measurement; -1 us: never.
struct Ages {
  Duration ins, gps, odometry, rolling, prior_map;
};
[[nodiscard]] Ages ages(const FilterState& s);

/// Driven since the newest accepted fix, or since the start.
[[nodiscard]] double distance_since_gps_m(const FilterState& s);

[[nodiscard]] Mode mode(const FilterState& s, const WmParams& params);

}  // namespace rcs::wm

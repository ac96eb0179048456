#pragma once
// Sources that currently support the belief: ages of the measurements and navigation mode.

#include "modules/wm/filter.h"

namespace rcs::wm {

/// The values are those of nav_state_t.
enum class Mode : int {
  kAlign = 0,
  kGpsIns = 1,
  kGpsInsLadar = 2,
  kInsLadar = 3,
  kInsDeadReckoning = 4,
  kGpsLadar = 5,  ///< GPS without INS; with or without LADAR (see its age)
  kLadar = 6,
  kLost = 7
};

/// Sensor time since the newest accepted measurement of each source; -1 us: none yet.
struct Ages {
  Duration ins, gps, odometry, rolling, prior_map;
};
[[nodiscard]] Ages ages(const FilterState& s);

/// Distance driven since the newest accepted fix, or since the start.
[[nodiscard]] double distance_since_gps_m(const FilterState& s);

[[nodiscard]] Mode mode(const FilterState& s, const WmParams& params);

}  // namespace rcs::wm

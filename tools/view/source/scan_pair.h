#pragma once
// Two scans of a log and their registration, as figures 2 and 3 of Madhavan and Messina: each point
// of the second scan and the point of the first one that is closest, before and after.

#include <nlohmann/json.hpp>

#include "rcs/base/result.h"
#include "rcs/base/stamp.h"
#include "tools/view/source/log_index.h"

namespace rcs::view {

struct ScanPairRequest {
  Duration time{};  ///< DATA is the newest complete scan at this moment
  int apart = 5;    ///< MODEL is the scan this many before, at most kMaxApart
  /// The guess is the motion that WM estimated between the two scans; else it is the identity, as
  /// in the paper's data sets #1 and #2.
  bool guess_by_wm = false;
};
inline constexpr int kMaxApart = 40;

/// Registers the two scans of SP_POINTS with the production method of `rcs register`, which gives
/// the same mean distances for the same points.
/// @return an error if the log does not have two complete scans there
[[nodiscard]] Result<nlohmann::ordered_json> scan_pair(LogIndex* index,
                                                       const ScanPairRequest& request);

}  // namespace rcs::view

#pragma once
// What a vehicle drove through, and why there: from the messages of WM and BG alone, so for any
// log.

#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/rcs/routes_t.hpp"
#include "rcs/base/result.h"
#include "tools/report/svg_plot.h"

namespace rcs::evaluation {

struct DrivingRecord {
  /// The obstacles of WM, the paths that BG planned, the routes of the mission, the course and the
  /// protection level around it, seen from above. Frame local.
  report::Plot plot;
  std::vector<routes_t> choices;  ///< of the mission, in order of time
};

/// @param log  path
/// @return nullopt: BG has planned no path in it; an error if the log cannot be read
[[nodiscard]] Result<std::optional<DrivingRecord>> driving_record(const std::string& log);

}  // namespace rcs::evaluation

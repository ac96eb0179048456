#pragma once
// What a vehicle drove through, and why there: from the messages of WM and BG alone, so for any
// log.

#include <optional>
#include <string>

#include "rcs/base/result.h"
#include "tools/report/svg_plot.h"

namespace rcs::evaluation {

/// The obstacles of WM, the paths that BG planned, the course and the protection level around it,
/// seen from above. Frame local.
/// @param log  path
/// @return nullopt: BG has planned no path in it; an error if the log cannot be read
[[nodiscard]] Result<std::optional<report::Plot>> driving_plot(const std::string& log);

}  // namespace rcs::evaluation

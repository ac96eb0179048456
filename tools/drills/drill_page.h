#pragma once
// The results of drills as one self-contained HTML page.

#include <string>
#include <vector>

#include "tools/drills/drill_result.h"

namespace rcs::drills {

/// @param drive  path of the log or the scenario
[[nodiscard]] std::string drill_page(const std::vector<DrillResult>& results,
                                     const std::string& drive);

}  // namespace rcs::drills

#pragma once
// The results of drills as one self-contained page.

#include <string>
#include <vector>

#include "tools/drills/drill_result.h"

namespace rcs::drills {

/// @param drive  what was driven: a log's or a scenario's path
[[nodiscard]] std::string drill_page(const std::vector<DrillResult>& results,
                                     const std::string& drive);

}  // namespace rcs::drills

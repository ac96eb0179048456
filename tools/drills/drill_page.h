#pragma once
// The results of drills as one self-contained HTML page.

#include <string>
#include <vector>

#include "tools/drills/drill_result.h"
#include "tools/report/html_page.h"

namespace rcs::drills {

/// @param drive  path of the log or the scenario
/// @param logs_folder  with DRILL.log of the first seed of each drill; empty: no logs
[[nodiscard]] std::string drill_page(const std::vector<DrillResult>& results,
                                     const std::string& drive, const std::string& logs_folder,
                                     const report::PageOrigin& origin);

}  // namespace rcs::drills

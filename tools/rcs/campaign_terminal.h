#pragma once
// A campaign of drills with a progress bar and Ctrl-C; shared by the commands that run drills.

#include <string>
#include <string_view>
#include <vector>

#include "tools/drills/drill_campaign.h"

namespace rcs::cli {

/// run_campaign() with a progress bar on stderr; Ctrl-C and SIGTERM end it.
/// @param command  label of the bar
/// @param out_folder  created before the first run; empty: no folder
/// @param jobs  parallel runs; 0: one per core
/// @param campaign  complete except for `jobs`, `stop` and `progress`
/// @return as run_campaign(), or an error if the folder cannot be created
[[nodiscard]] Result<std::vector<drills::DrillResult>> run_campaign_at_terminal(
    std::string_view command, const std::string& out_folder, int jobs,
    drills::DrillCampaign campaign);

}  // namespace rcs::cli

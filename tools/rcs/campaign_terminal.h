#pragma once
// A campaign of drills for the person at a terminal who started it: what the commands that drive
// many times have in common.

#include <string>
#include <string_view>
#include <vector>

#include "tools/drills/drill_campaign.h"

namespace rcs::cli {

/// run_campaign() with a bar on stderr until it is done; Ctrl-C and SIGTERM end it.
/// @param command  the bar's label
/// @param out_folder  is made before the first drive; empty: none is
/// @param jobs  drives at a time; 0: one a core
/// @param campaign  but for `jobs`, `stop` and `progress`
/// @return as run_campaign(), or an error when the folder cannot be made
[[nodiscard]] Result<std::vector<drills::DrillResult>> run_campaign_at_terminal(
    std::string_view command, const std::string& out_folder, int jobs,
    drills::DrillCampaign campaign);

}  // namespace rcs::cli

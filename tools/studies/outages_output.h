#pragma once
// Errors after outages as JSON and as tables.

#include <nlohmann/json.hpp>

#include "tools/report/table.h"
#include "tools/studies/outages.h"

namespace rcs::studies {

/// One row for each length and variant: median / maximum.
[[nodiscard]] report::Table outage_table(const OutageReport& report);
/// The errors of the other estimators, which begin with the belief of WM.
[[nodiscard]] report::Table dead_reckoning_table(const OutageReport& report);
/// One row for each estimator of a cut.
[[nodiscard]] report::Table cut_table(const OutageReport& report);
[[nodiscard]] nlohmann::ordered_json to_json(const OutageReport& report);

}  // namespace rcs::studies

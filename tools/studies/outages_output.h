#pragma once
// What outages cost, for programs (JSON) and as tables for people.

#include <nlohmann/json.hpp>

#include "tools/report/table.h"
#include "tools/studies/outages.h"

namespace rcs::studies {

/// One row for each length and variant: median and worst.
[[nodiscard]] report::Table outage_table(const OutageReport& report);
/// One row for each teller of a cut.
[[nodiscard]] report::Table cut_table(const OutageReport& report);
[[nodiscard]] nlohmann::ordered_json to_json(const OutageReport& report);

}  // namespace rcs::studies

#pragma once
// Results of closed-loop drives as a table and as JSON.

#include <vector>

#include "tools/driving/drive_campaign.h"
#include "tools/report/json_document.h"
#include "tools/report/table.h"

namespace rcs::driving {

/// A row for each drive.
[[nodiscard]] report::Table drive_table(const std::vector<DriveRow>& rows);

/// Sums over all drives: arrived, contacts, mean speed.
[[nodiscard]] std::string drive_summary(const std::vector<DriveRow>& rows);

/// {"summary": ..., "drives": [...]}, docs/reference/json/drive.schema.json.
[[nodiscard]] report::Json to_json(const std::vector<DriveRow>& rows);

}  // namespace rcs::driving

#pragma once
// The results of drills for programs (JSON, JUnit XML) and as tables for people.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/drills/drill_result.h"
#include "tools/report/table.h"

namespace rcs::drills {

[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<DrillResult>& results);
/// A test case for every mark of every drill; one that is open counts as skipped.
[[nodiscard]] std::string to_junit(const std::vector<DrillResult>& results);
/// One row a drill: the figures beside their marks.
[[nodiscard]] report::Table drill_table(const std::vector<DrillResult>& results);
/// Every mark of one drill.
[[nodiscard]] report::Table mark_table(const DrillResult& result);
/// Figures of one drill that no mark is set on, by seed.
[[nodiscard]] report::Table run_table(const DrillResult& result);

/// "pass", "FAIL", "open", "error" or "not run".
[[nodiscard]] std::string verdict_text(const DrillResult& result);
[[nodiscard]] std::string_view verdict_text(Verdict verdict);
/// "1.2 !" for a figure that misses its mark, "1.2 ?" for one that too few runs are behind.
[[nodiscard]] std::string marked(const std::string& figure, Verdict verdict);
[[nodiscard]] nlohmann::ordered_json number_or_null(const std::optional<double>& value);

}  // namespace rcs::drills

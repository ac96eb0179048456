#pragma once
// The results of drills as JSON, JUnit XML and tables.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/drills/drill_result.h"
#include "tools/report/table.h"

namespace rcs::drills {

[[nodiscard]] nlohmann::ordered_json to_json(const std::vector<DrillResult>& results);
/// A test case for every limit of every drill; inconclusive ones count as skipped.
[[nodiscard]] std::string to_junit(const std::vector<DrillResult>& results);
/// One row per drill: metrics with their verdicts.
[[nodiscard]] report::Table drill_table(const std::vector<DrillResult>& results);
/// Every limit of one drill.
[[nodiscard]] report::Table limit_table(const DrillResult& result);
/// Metrics of one drill without limits, by seed.
[[nodiscard]] report::Table run_table(const DrillResult& result);

/// "pass", "FAIL", "inconclusive", "error" or "not run".
[[nodiscard]] std::string verdict_text(const DrillResult& result);
[[nodiscard]] std::string_view verdict_text(Verdict verdict);
/// "1.2 !" for a value that violates its limit, "1.2 ?" for an inconclusive one.
[[nodiscard]] std::string marked(const std::string& metric, Verdict verdict);
[[nodiscard]] nlohmann::ordered_json number_or_null(const std::optional<double>& value);

}  // namespace rcs::drills

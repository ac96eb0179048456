#pragma once
// What `rcs consistency` found, for programs (JSON), as tables and as a page.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/report/table.h"
#include "tools/studies/consistency_metrics.h"

namespace rcs::studies {

struct ConsistencyReport {
  ConsistencyPlan plan;
  std::vector<ConsistencyBlock> blocks;

  /// Nothing fails.
  [[nodiscard]] bool passed() const;
};

[[nodiscard]] nlohmann::ordered_json to_json(const ConsistencyReport& report);

/// NEES per degree of freedom by block, part and time; and the share of truths inside the 95 %
/// ellipsoid. A figure with ! misses its mark; with ? there are too few runs to tell.
[[nodiscard]] report::Table nees_table(const ConsistencyReport& report);
/// RMS error and what was claimed of it, [m], [m/s] and [deg].
[[nodiscard]] report::Table error_table(const ConsistencyReport& report);
/// Mean NIS per degree of freedom by block and source, with the lag-1 correlation.
[[nodiscard]] report::Table nis_table(const ConsistencyReport& report);

/// The protection level against the error while GPS is gone: told, not judged (`rcs drill` does).
[[nodiscard]] report::Table protection_table(const ConsistencyReport& report);

/// The marks in words.
[[nodiscard]] std::string marks_text();
/// "meadow": a scenario by its file's name.
[[nodiscard]] std::string scenario_name(const std::string& path);
/// "30 s, GPS" or "60 s without".
[[nodiscard]] std::string moment_text(const ConsistencyPlan& plan, double t_s);

}  // namespace rcs::studies

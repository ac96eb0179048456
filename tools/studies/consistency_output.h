#pragma once
// The results of `rcs consistency` as JSON and tables.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/report/table.h"
#include "tools/studies/consistency_metrics.h"

namespace rcs::studies {

struct ConsistencyReport {
  ConsistencyPlan plan;
  std::vector<ConsistencyBlock> blocks;

  /// True if no limit fails.
  [[nodiscard]] bool passed() const;
};

[[nodiscard]] nlohmann::ordered_json to_json(const ConsistencyReport& report);

/// NEES per degree of freedom by block, part and time; and the share of true states inside the 95 %
/// ellipsoid. A value with ! violates its limit; with ? it is inconclusive.
[[nodiscard]] report::Table nees_table(const ConsistencyReport& report);
/// RMS error and its prediction by the covariance, [m], [m/s] and [deg].
[[nodiscard]] report::Table error_table(const ConsistencyReport& report);
/// Mean NIS per degree of freedom by block and source, with the lag-1 correlation.
[[nodiscard]] report::Table nis_table(const ConsistencyReport& report);

/// The protection level against the error without GPS: reported, not judged (see `rcs drill`).
[[nodiscard]] report::Table protection_table(const ConsistencyReport& report);

/// The limits as text.
[[nodiscard]] std::string limits_text();
/// The file name of a scenario without extension: "meadow".
[[nodiscard]] std::string scenario_name(const std::string& path);
/// "30 s, GPS" or "60 s without".
[[nodiscard]] std::string moment_text(const ConsistencyPlan& plan, double t_s);

}  // namespace rcs::studies

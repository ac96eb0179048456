#pragma once
// The metrics of a run as tables and as JSON.

#include <nlohmann/json.hpp>

#include "tools/evaluation/evaluation.h"
#include "tools/report/table.h"

namespace rcs::evaluation {

using Json = nlohmann::ordered_json;

[[nodiscard]] Json to_json(const RunMetrics& f);
[[nodiscard]] Json to_json(const TrajectoryMetrics& f);
[[nodiscard]] Json to_json(const WorldMetrics& f);
/// @param zero  zero of the times of the outage
[[nodiscard]] Json to_json(const OutageMetrics& f, Stamp zero);

[[nodiscard]] report::Table scan_table(const RunMetrics& f);
[[nodiscard]] report::Table latency_table(const RunMetrics& f);
[[nodiscard]] report::Table absolute_table(const TrajectoryMetrics& f);
[[nodiscard]] report::Table relative_table(const TrajectoryMetrics& f);
[[nodiscard]] report::Table world_table(const WorldMetrics& f);
[[nodiscard]] report::Table outage_table(const std::vector<OutageMetrics>& outages, Stamp zero);

}  // namespace rcs::evaluation

#pragma once
// The metrics of a run as tables and as JSON.

#include <nlohmann/json.hpp>

#include "tools/evaluation/evaluation.h"
#include "tools/report/table.h"

namespace rcs::evaluation {

using Json = nlohmann::ordered_json;

[[nodiscard]] Json to_json(const RunFigures& f);
[[nodiscard]] Json to_json(const TrajectoryFigures& f);
[[nodiscard]] Json to_json(const WorldFigures& f);
/// @param zero  zero of the times of the outage
[[nodiscard]] Json to_json(const OutageFigures& f, Stamp zero);

[[nodiscard]] report::Table scan_table(const RunFigures& f);
[[nodiscard]] report::Table latency_table(const RunFigures& f);
[[nodiscard]] report::Table absolute_table(const TrajectoryFigures& f);
[[nodiscard]] report::Table relative_table(const TrajectoryFigures& f);
[[nodiscard]] report::Table world_table(const WorldFigures& f);
[[nodiscard]] report::Table outage_table(const std::vector<OutageFigures>& outages, Stamp zero);

}  // namespace rcs::evaluation

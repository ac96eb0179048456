#pragma once
// Scenarios from TOML (config/sim/*.toml), read strictly; see rcs/node/params/params.h.

#include <cstdint>
#include <optional>
#include <string>

#include "rcs/base/result.h"
#include "sim/scenario.h"

namespace rcs::sim {

/// Parameters that a study varies without another file.
struct ScenarioOverrides {
  std::optional<std::int64_t> seed;
  std::string ins_grade;               ///< empty: as in the file
  std::optional<Outage> gps_outage;    ///< replaces the outages of the file
  std::optional<Outage> ladar_outage;  ///< the same for the LADAR
  std::optional<double> gps_lost_after_m;
  std::optional<double> duration_s;
};

/// Reads a scenario, with the INS grades and the DEM that it names (relative to the file of the
/// scenario).
[[nodiscard]] Result<Scenario> load_scenario(const std::string& path,
                                             const ScenarioOverrides& overrides);

}  // namespace rcs::sim

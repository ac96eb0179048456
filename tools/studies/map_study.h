#pragma once
// Position error without GPS as a function of map resolution: drives with maps of several
// resolutions and without a map. Pure functions of the records of many runs.

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/drills/drill_record.h"
#include "tools/drills/drill_spec.h"
#include "tools/report/table.h"

namespace rcs::studies {

struct MapStudyPlan {
  double gps_lost_s = 35.0;  ///< permanently, after the first sensor message, [10, 1000]
  double length_s = 0.0;     ///< of the drive; 0: the whole drive
  std::string ins;           ///< INS grade; empty: as configured

  /// @param cell_m  of the map; nullopt: no map
  [[nodiscard]] drills::Drill drill(const std::string& scenario,
                                    std::optional<double> cell_m) const;
};

/// Errors of one run, once per second from the loss of GPS to the end.
struct MapStudyRun {
  std::vector<double> error_m;       ///< of the position, three axes
  std::vector<double> horizontal_m;  ///< horizontal part
  std::size_t inside = 0;            ///< true positions inside the 95 % ellipsoid
  std::size_t missing = 0;           ///< seconds without a belief
  double driven_m = 0.0;
  double slope_rms_rad = 0.0;  ///< of the ground under the vehicle: its relief
};
[[nodiscard]] MapStudyRun map_study_run(const MapStudyPlan& plan,
                                        const drills::DrillRecord& record);

/// Runs of one scenario with one map.
struct MapStudyBlock {
  std::string scenario;
  std::optional<double> cell_m;
  std::vector<MapStudyRun> runs;
  std::string error;  ///< reason of a failure; empty: none
};

struct MapStudyMetrics {
  std::size_t samples = 0;
  std::size_t missing = 0;
  double median_m = 0.0;
  double p95_m = 0.0;
  double max_m = 0.0;
  double horizontal_p95_m = 0.0;
  double rms_m = 0.0;
  double inside = 0.0;  ///< share
  double driven_m = 0.0;
  double slope_rms_rad = 0.0;
};
/// Over all seconds of all runs.
[[nodiscard]] MapStudyMetrics map_study_metrics(const MapStudyBlock& block);

/// @param blocks  the first one of a scenario is without a map
[[nodiscard]] report::Table map_study_table(const std::vector<MapStudyBlock>& blocks);
[[nodiscard]] nlohmann::ordered_json map_study_json(const std::vector<MapStudyBlock>& blocks);
/// 95 % of the error over the cell of the map, one line per scenario.
[[nodiscard]] std::string map_study_svg(const std::vector<MapStudyBlock>& blocks);

}  // namespace rcs::studies

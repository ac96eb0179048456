#pragma once
// What a survey is worth to a vehicle without GPS: the errors of one drive with maps of several
// resolutions and with none. Pure functions of the records of many runs.

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/drills/drill_record.h"
#include "tools/drills/drill_spec.h"
#include "tools/report/table.h"

namespace rcs::studies {

struct MapWorthPlan {
  double gps_lost_s = 35.0;  ///< for good, after the first sensor message, [10, 1000]
  double length_s = 0.0;     ///< of the drive; 0: all of it
  std::string ins;           ///< grade; empty: as configured

  /// @param cell_m  of the map; none: there is none
  [[nodiscard]] drills::Drill drill(const std::string& scenario,
                                    std::optional<double> cell_m) const;
};

/// Of one run, once a second from the loss of GPS to the end.
struct MapWorthRun {
  std::vector<double> error_m;       ///< of the position, three axes
  std::vector<double> horizontal_m;  ///< of these, in the plane
  std::size_t inside = 0;            ///< truths inside the 95 % ellipsoid of the position
  std::size_t missing = 0;           ///< seconds without a belief
  double driven_m = 0.0;
  double slope_rms_rad = 0.0;  ///< of the ground under the vehicle: its relief
};
[[nodiscard]] MapWorthRun map_worth_run(const MapWorthPlan& plan,
                                        const drills::DrillRecord& record);

/// Runs of one scenario with one map.
struct MapWorthBlock {
  std::string scenario;
  std::optional<double> cell_m;
  std::vector<MapWorthRun> runs;
  std::string error;  ///< it could not be run; empty: it was
};

struct MapWorthFigure {
  std::size_t samples = 0;
  std::size_t missing = 0;
  double median_m = 0.0;
  double p95_m = 0.0;
  double most_m = 0.0;
  double horizontal_p95_m = 0.0;
  double rms_m = 0.0;
  double inside = 0.0;  ///< share
  double driven_m = 0.0;
  double slope_rms_rad = 0.0;
};
/// Over all seconds of all runs.
[[nodiscard]] MapWorthFigure map_worth_figure(const MapWorthBlock& block);

/// @param blocks  of a scenario, the one without a map is the first
[[nodiscard]] report::Table map_worth_table(const std::vector<MapWorthBlock>& blocks);
[[nodiscard]] nlohmann::ordered_json map_worth_json(const std::vector<MapWorthBlock>& blocks);
/// 95 % of the error over the maps' cell, a line a scenario.
[[nodiscard]] std::string map_worth_svg(const std::vector<MapWorthBlock>& blocks);

}  // namespace rcs::studies

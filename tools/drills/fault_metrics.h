#pragma once
// Metrics of a run with randomly drawn faults, its line in the file of results, and the table of
// all runs by class of fault.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "tools/drills/drill_metrics.h"
#include "tools/drills/random_faults.h"
#include "tools/report/table.h"

namespace rcs::drills {

/// The result of one run. Times are relative to the first sensor message.
struct FaultRun {
  int index = 0;
  std::int64_t seed = 0;
  std::string scenario;             ///< file name without .toml
  std::vector<std::string> faults;  ///< names of the classes
  std::string description;          ///< with sizes
  bool gps_lost = false;
  double begin_s = 0.0;           ///< of the first fault
  double end_s = 0.0;             ///< of the last fault
  double horizontal_max_m = 0.0;  ///< largest errors from the begin of the first fault on
  double vertical_max_m = 0.0;
  double horizontal_end_m = 0.0;  ///< largest of the last 5 s of the run
  double vertical_end_m = 0.0;
  double driven_m = 0.0;           ///< from the begin of the first fault to its largest error
  double within_horizontal = 1.0;  ///< share of the time with the error below the level
  double within_vertical = 1.0;
  std::optional<double> level_horizontal_m;  ///< median of the protection levels; none: infinite
  std::optional<double> level_vertical_m;
  double bounded = 1.0;   ///< share of the time with a finite level
  int missed_alerts = 0;  ///< above the level for 2 s without an alert
  double smooth_step_m = 0.0;
  std::vector<std::string> wrongly_excluded;  ///< sources without a fault that were excluded
  std::optional<double> excluded_after_s;     ///< first exclusion of a faulty source
  std::optional<double> readmitted_after_s;   ///< after the end of its fault
  std::optional<double> gps_after_s;          ///< first fix accepted after GPS was right again
  std::uint64_t hash = 0;
  std::string error;  ///< of a run that failed; empty: none

  /// The limit of the horizontal error with two other independent sources: 2 m, or 1 % of the
  /// distance where GPS is lost.
  [[nodiscard]] double limit_m() const;
};

[[nodiscard]] FaultRun fault_run(const RandomFault& fault, int index, const DrillRecord& record);

/// One line of JSON without a line end.
[[nodiscard]] std::string to_json_line(const FaultRun& run);
[[nodiscard]] Result<FaultRun> parse_json_line(const std::string& line);

/// One row a class of faults; a run with two faults counts in both.
[[nodiscard]] report::Table fault_table(const std::vector<FaultRun>& runs);
/// The runs outside of a limit, the worst first.
[[nodiscard]] report::Table violation_table(const std::vector<FaultRun>& runs, std::size_t most);
/// Sums over all runs.
[[nodiscard]] nlohmann::ordered_json fault_summary(const std::vector<FaultRun>& runs);

}  // namespace rcs::drills

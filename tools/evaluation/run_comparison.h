#pragma once
// Comparison of runs of one drive: sources fused while GPS was denied, and horizontal error over
// the whole outage. Pure functions.

#include <optional>
#include <string>
#include <vector>

#include "tools/evaluation/evaluation.h"
#include "tools/evaluation/evaluation_tables.h"
#include "tools/report/table.h"

namespace rcs::evaluation {

/// Errors of one run.
struct ComparedRun {
  std::string name;
  tools::Summary with_gps_m;  ///< horizontal error outside the outages
  double nees_per_dof = 0.0;
  std::vector<OutageMetrics> outages;           ///< the same intervals for all runs
  std::vector<std::vector<std::string>> fused;  ///< sources by outage, as of fused_sources()
};

/// @param outages  the same for all runs that are compared
[[nodiscard]] ComparedRun compare_run(const std::string& name, const recording::RunLog& log,
                                      const WorldMetrics& world,
                                      const std::vector<TimeInterval>& outages);

/// One row for each run and outage; one for each run if there is no outage.
/// False if a run fused GPS in one of the intervals (--gps-cut of a run with GPS).
[[nodiscard]] bool gps_denied(const std::vector<ComparedRun>& runs);

[[nodiscard]] report::Table comparison_table(const std::vector<ComparedRun>& runs);

/// For pairs of runs that differ only by the LADAR (and the a priori map, which requires it): the
/// RMS error without it over that with it. The maximum over the pairs, in the outage where that is
/// smallest; nullopt without an outage or if an outage has no such pair.
[[nodiscard]] std::optional<double> ladar_factor(const std::vector<ComparedRun>& runs);

/// A sentence for each outage with such a pair: the errors with and without the LADAR.
[[nodiscard]] std::string comparison_text(const std::vector<ComparedRun>& runs);

/// @param zero  zero of the times of the outages
[[nodiscard]] Json to_json(const ComparedRun& run, Stamp zero);

}  // namespace rcs::evaluation

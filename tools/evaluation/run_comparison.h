#pragma once
// Comparison of runs of one drive: sources fused while GPS was denied, and horizontal error over
// the whole outage. Pure functions.

#include <optional>
#include <string>
#include <vector>

#include "tools/evaluation/evaluation.h"
#include "tools/evaluation/evaluation_tables.h"
#include "tools/evaluation/run_trace.h"
#include "tools/evaluation/uncertainty.h"
#include "tools/report/table.h"

namespace rcs::evaluation {

/// One run of a comparison.
struct ComparedRun {
  std::string name;
  bool with_truth = true;     ///< false: no error is known, and all of them are 0
  tools::Summary with_gps_m;  ///< horizontal error outside the outages
  double nees_per_dof = 0.0;
  std::vector<OutageMetrics> outages;           ///< the same intervals for all runs
  std::vector<std::vector<std::string>> fused;  ///< sources by outage, as of fused_sources()
  std::vector<UncertaintyMetrics> uncertainty;  ///< by outage
};

/// @param world  nullptr: without a truth; the distances are those of the estimate
/// @param outages  the same for all runs that are compared
[[nodiscard]] ComparedRun compare_run(const std::string& name, const recording::RunLog& log,
                                      const RunTrace& trace, const WorldMetrics* world,
                                      const std::vector<TimeInterval>& outages);

/// False if a run fused GPS in one of the intervals (--gps-cut of a run with GPS).
[[nodiscard]] bool gps_denied(const std::vector<ComparedRun>& runs);

/// One row for each run and outage; one for each run if there is no outage. Errors, or without a
/// truth the published uncertainty.
[[nodiscard]] report::Table comparison_table(const std::vector<ComparedRun>& runs);

/// For pairs of runs that differ only by the LADAR (and the a priori map, which requires it): the
/// RMS error without it over that with it. The maximum over the pairs, in the outage where that is
/// smallest; nullopt without an outage, without a truth, or if an outage has no such pair.
[[nodiscard]] std::optional<double> ladar_factor(const std::vector<ComparedRun>& runs);

/// A sentence for each outage with such a pair: the errors with and without the LADAR.
[[nodiscard]] std::string comparison_text(const std::vector<ComparedRun>& runs);

/// Errors are null without a truth.
/// @param zero  zero of the times of the outages
[[nodiscard]] Json to_json(const ComparedRun& run, Stamp zero);

}  // namespace rcs::evaluation

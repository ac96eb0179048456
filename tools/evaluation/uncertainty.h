#pragma once
// Speed, published uncertainty and protection levels of a run over time: without a truth, what is
// known of its errors.

#include <vector>

#include "tools/evaluation/evaluation.h"
#include "tools/evaluation/run_trace.h"
#include "tools/report/svg_plot.h"

namespace rcs::evaluation {

/// What WM published at the end of an interval.
struct UncertaintyMetrics {
  double sigma_horizontal_m = 0.0;       ///< not finite: the world pose was invalid
  double protection_horizontal_m = 0.0;  ///< not finite: no level was known
};

[[nodiscard]] UncertaintyMetrics uncertainty_at_end(const recording::RunLog& run,
                                                    const RunTrace& trace,
                                                    const TimeInterval& interval);

/// Along the estimate in frame local.
[[nodiscard]] double distance_driven_m(const recording::RunLog& run, const TimeInterval& interval);

/// Horizontal and vertical: protection level, alert limit, 3 sigma, and the error if it is known;
/// without a truth also 3 sigma of the heading. A quantity that WM never published is left out.
/// @param world  nullptr: without a truth
/// @param zero  zero of the time axis
[[nodiscard]] std::vector<report::Plot> uncertainty_plots(const recording::RunLog& run,
                                                          const RunTrace& trace,
                                                          const WorldMetrics* world,
                                                          const std::vector<TimeInterval>& outages,
                                                          Stamp zero);

/// @param zero  zero of the time axis
[[nodiscard]] report::Plot speed_plot(const RunTrace& trace,
                                      const std::vector<TimeInterval>& outages, Stamp zero);

/// Explains uncertainty_plots().
[[nodiscard]] const char* uncertainty_text();

}  // namespace rcs::evaluation

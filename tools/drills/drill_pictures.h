#pragma once
// The plots of one run of a drill.

#include <vector>

#include "tools/drills/drill_record.h"
#include "tools/drills/drill_spec.h"
#include "tools/report/svg_plot.h"

namespace rcs::drills {

/// From above: truth, WM and its sub-filters, from 10 s before the first stimulus.
[[nodiscard]] report::Plot drill_course(const Drill& drill, const DrillRecord& record);

/// Horizontal and vertical errors of WM and its sub-filters, and the protection level, over time.
[[nodiscard]] std::vector<report::Plot> drill_error_plots(const Drill& drill,
                                                          const DrillRecord& record);

/// Mode, fixes, source status, alerts and events over time.
[[nodiscard]] report::Plot drill_time_line(const Drill& drill, const DrillRecord& record);

}  // namespace rcs::drills

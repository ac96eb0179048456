#pragma once
// The pictures of one run of a drill.

#include <vector>

#include "tools/drills/drill_record.h"
#include "tools/drills/drill_spec.h"
#include "tools/report/svg_plot.h"

namespace rcs::drills {

/// From above: truth, WM's answer and its sub-filters, from 10 s before the drill begins.
[[nodiscard]] report::Plot drill_course(const Drill& drill, const DrillRecord& record);

/// Horizontal and vertical error, WM's and its sub-filters', against the protection level, over
/// time.
[[nodiscard]] std::vector<report::Plot> drill_error_plots(const Drill& drill,
                                                          const DrillRecord& record);

/// Mode, fixes, trust, alerts and events on one time line.
[[nodiscard]] report::Plot drill_time_line(const Drill& drill, const DrillRecord& record);

}  // namespace rcs::drills

#pragma once
// The plots of a run.

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/evaluation/evaluation.h"
#include "tools/report/svg_plot.h"

namespace rcs::evaluation {

struct NamedTrajectory {
  std::string name;
  tools::Trajectory poses;
};

/// "world", "local" or "rolling".
[[nodiscard]] std::string_view frame_name(recording::Frame frame);

/// The outages as shaded intervals of a time axis.
/// @param zero  zero of the time axis
[[nodiscard]] std::vector<report::Shade> outage_shades(const std::vector<TimeInterval>& outages,
                                                       Stamp zero);

/// The course from above: truth dashed, the first estimate highlighted where GPS was denied.
/// @param frame  of the poses: world has its axes east and north
[[nodiscard]] report::Plot course_plot(const tools::Trajectory& truth,
                                       const std::vector<NamedTrajectory>& estimates,
                                       const std::vector<TimeInterval>& outages,
                                       recording::Frame frame);

/// Horizontal, vertical and heading error of the world pose with its published 3 sigma.
/// @param zero  zero of the time axis
[[nodiscard]] std::vector<report::Plot> error_plots(const WorldMetrics& metrics,
                                                    const std::vector<TimeInterval>& outages,
                                                    Stamp zero);

/// The horizontal errors of several runs in one plot with a log scale.
[[nodiscard]] report::Plot comparison_plot(
    const std::vector<std::pair<std::string, const WorldMetrics*>>& runs,
    const std::vector<TimeInterval>& outages, Stamp zero);

/// Position error along the course, after alignment.
[[nodiscard]] report::Plot aligned_error_plot(const PosePairs& pairs, const Pose& T_truth_estimate);

/// The points of SP from above, coloured by height, for scans with a reference instant in `poses`.
[[nodiscard]] Result<report::CellMap> read_map(const std::string& log_path,
                                               const tools::Trajectory& poses);
[[nodiscard]] report::Plot map_plot(report::CellMap map, const tools::Trajectory& poses,
                                    recording::Frame frame);

/// Histogram of a duration.
[[nodiscard]] report::Plot latency_plot(const std::string& title,
                                        const std::vector<double>& values_ms);
/// One plot for every node of the run.
[[nodiscard]] std::vector<report::Plot> node_plots(const recording::RunLog& run);

}  // namespace rcs::evaluation

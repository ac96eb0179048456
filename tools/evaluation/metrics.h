#pragma once
// The pictures of a run.

#include <string>
#include <utility>
#include <vector>

#include "tools/evaluation/evaluation.h"
#include "tools/report/svg_plot.h"

namespace rcs::evaluation {

struct NamedTrajectory {
  std::string name;
  tools::Trajectory poses;
};

/// The course from above: truth dashed, the first estimate set off where GPS was denied.
/// @param frame  of the poses: world has its axes east and north
[[nodiscard]] report::Plot course_plot(const tools::Trajectory& truth,
                                       const std::vector<NamedTrajectory>& estimates,
                                       const std::vector<TimeInterval>& outages,
                                       recording::Frame frame);

/// Horizontal, vertical and heading error of the world pose against three of its own sigmas.
/// @param zero  of the time axis
[[nodiscard]] std::vector<report::Plot> error_plots(const WorldFigures& figures,
                                                    const std::vector<TimeInterval>& outages,
                                                    Stamp zero);

/// The horizontal errors of several runs in one picture, on a scale of decades.
[[nodiscard]] report::Plot comparison_plot(
    const std::vector<std::pair<std::string, const WorldFigures*>>& runs,
    const std::vector<TimeInterval>& outages, Stamp zero);

/// Distance from the truth along the course, after alignment.
[[nodiscard]] report::Plot aligned_error_plot(const PosePairs& pairs, const Pose& T_truth_estimate);

/// SP's points from above, coloured by height, where `poses` has the scan's reference instant.
[[nodiscard]] Result<report::CellMap> read_map(const std::string& log_path,
                                               const tools::Trajectory& poses);
[[nodiscard]] report::Plot map_plot(report::CellMap map, const tools::Trajectory& poses,
                                    recording::Frame frame);

/// How often something took how long.
[[nodiscard]] report::Plot latency_plot(const std::string& title,
                                        const std::vector<double>& values_ms);
/// One for every node of the run.
[[nodiscard]] std::vector<report::Plot> node_plots(const recording::RunLog& run);

}  // namespace rcs::evaluation

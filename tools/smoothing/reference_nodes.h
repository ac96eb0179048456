#pragma once
// Builds the pose graph of a recording: its nodes and all measurements except the scans. Pure.

#include <cstddef>
#include <vector>

#include "tools/smoothing/pose_graph.h"
#include "tools/smoothing/reference_recording.h"

namespace rcs::smoothing {

/// A moment whose pose is unknown, with the scans around it.
struct ReferenceNode {
  Stamp stamp;  ///< reference instant of a scan, if there are scans
  std::size_t first_scan = 0, end_scan = 0;
};

struct ReferenceGraph {
  std::vector<ReferenceNode> nodes;
  std::vector<double> travelled_m;  ///< distance driven up to each node
  PoseGraph graph;                  ///< without matches
  GraphState start;                 ///< initial state from WM
  bool has_world = false;           ///< true: frame world by GPS; else frame local of WM
  std::vector<std::size_t> bias_stretch, gps_stretch;  ///< section of each node
};

struct NodeParams {
  double spacing_s = 0.5;
  double bias_stretch_s = 10.0;
  double gps_stretch_s = 2.0;
};

/// The vehicle in frame local of WM at `stamp`: interpolated along the screw motion, extrapolated
/// before the first and after the last belief.
[[nodiscard]] Pose local_pose(const ReferenceRecording& recording, Stamp stamp);

[[nodiscard]] ReferenceGraph make_reference_graph(const ReferenceRecording& recording,
                                                  const wm::WmParams& wm, const NodeParams& params);

/// Repeats the preintegration with the current estimates of the sensor errors.
void preintegrate_edges(const ReferenceRecording& recording, const GraphState& state,
                        const wm::WmParams& wm, ReferenceGraph* graph);

/// Estimates the delay of the scans against their stamps from rotations on rough ground: rotations
/// of SP between scans against the smoothed ones.
struct LadarDelay {
  double delay_s = 0.0;
  double sigma_s = 0.0;  ///< 0: not measured, without INS or with too little rotation
  std::size_t scans = 0;
};
[[nodiscard]] LadarDelay measure_ladar_delay(const ReferenceRecording& recording,
                                             const ReferenceGraph& graph, const GraphState& state);

/// The vehicle at `stamp`: between two nodes along the motion of WM, corrected to meet both nodes.
[[nodiscard]] Pose smoothed_pose(const ReferenceRecording& recording, const ReferenceGraph& graph,
                                 const GraphState& state, Stamp stamp);

}  // namespace rcs::smoothing

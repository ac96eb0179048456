#pragma once
// From a recording to a pose graph: where its nodes are, and what everything but the scans says of
// them. Pure.

#include <cstddef>
#include <vector>

#include "tools/smoothing/pose_graph.h"
#include "tools/smoothing/reference_recording.h"

namespace rcs::smoothing {

/// A moment whose pose is unknown, with the scans around it.
struct TruthNode {
  Stamp stamp;  ///< a scan's reference instant, where there are scans
  std::size_t first_scan = 0, end_scan = 0;
};

struct TruthGraph {
  std::vector<TruthNode> nodes;
  std::vector<double> way_m;  ///< driven up to each node
  PoseGraph graph;            ///< without matches
  GraphState start;           ///< as WM knew it
  bool has_world = false;     ///< GPS says where it is; else the frame is WM's local one
  std::vector<std::size_t> bias_stretch, gps_stretch;  ///< of each node
};

struct NodeParams {
  double spacing_s = 0.5;
  double bias_stretch_s = 10.0;
  double gps_stretch_s = 2.0;
};

/// The vehicle in WM's frame local at `stamp`, between its beliefs on the screw motion, before the
/// first and after the last along their motion.
[[nodiscard]] Pose local_pose(const TruthRecording& recording, Stamp stamp);

[[nodiscard]] TruthGraph make_truth_graph(const TruthRecording& recording, const wm::WmParams& wm,
                                          const NodeParams& params);

/// Takes the inertial samples together anew, by what is known now of their errors.
void preintegrate_edges(const TruthRecording& recording, const GraphState& state,
                        const wm::WmParams& wm, TruthGraph* graph);

/// How long after their stamps the scans were measured, by how the vehicle turns on rough ground:
/// SP's turns of the scans against the smoothed ones.
struct LadarDelay {
  double delay_s = 0.0;
  double sigma_s = 0.0;  ///< 0: not measured, there is no INS or too little turns
  std::size_t scans = 0;
};
[[nodiscard]] LadarDelay measure_ladar_delay(const TruthRecording& recording,
                                             const TruthGraph& graph, const GraphState& state);

/// The vehicle at `stamp`: between the two nodes around it along WM's motion, which starts at the
/// one and ends at the other.
[[nodiscard]] Pose smoothed_pose(const TruthRecording& recording, const TruthGraph& graph,
                                 const GraphState& state, Stamp stamp);

}  // namespace rcs::smoothing

#pragma once
// The reference trajectory of a recorded drive: INS, GPS, wheels and registrations between scans,
// smoothed together in a few rounds, each of which repeats the registrations from better poses.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "tools/smoothing/graph_solver.h"
#include "tools/smoothing/reference_matching.h"
#include "tools/smoothing/reference_nodes.h"

namespace rcs::smoothing {

struct ReferenceParams {
  NodeParams nodes;
  MatchingParams matching;
  SolverParams solver;
  /// Maximum number of rounds of registration and solution, after one without scans. Maps are made
  /// with the poses of the previous round: an error of their scale is halved in each round.
  int rounds = 8;
  double settled_m = 0.005;      ///< the last round moves the nodes by less (RMS)
  double residual_gate_m = 0.3;  ///< of points that count for the residual of the map
};

struct ReferenceRound {
  MatchCount consecutive, revisit;
  int iterations = 0;
  bool converged = false;
  double moved_m = 0.0;  ///< motion of the nodes in this round, RMS
};

struct ReferenceResult {
  ReferenceGraph graph;
  SolvedGraph solved;
  GraphCovariance covariance;
  LadarDelay delay;
  std::vector<ReferenceRound> rounds;
  MapResidual residual_before;  ///< with the online poses of WM
  MapResidual residual_after;
};

/// Progress of the smoother: completed share of its work.
using ReferenceProgress = std::function<void(double)>;

/// @return an error if the poses are not determined, or `stop` returned true
[[nodiscard]] Result<ReferenceResult> smooth(const ReferenceRecording& recording,
                                             const ReferenceVehicle& vehicle,
                                             const ReferenceParams& params,
                                             const ReferenceProgress& progress,
                                             const std::function<bool()>& stop);

/// seen_pose() of each node.
[[nodiscard]] std::vector<Pose> seen_poses(const PoseGraph& graph, const GraphState& state);

}  // namespace rcs::smoothing

#pragma once
// The truth of a recorded drive: INS, GPS, wheels and the scans among themselves, smoothed together
// in a few rounds, each of which registers the scans anew from better poses.

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "tools/smoothing/graph_solver.h"
#include "tools/smoothing/reference_matching.h"
#include "tools/smoothing/reference_nodes.h"

namespace rcs::smoothing {

struct TruthParams {
  NodeParams nodes;
  MatchingParams matching;
  SolverParams solver;
  /// Of registering and solving, after one without scans, at most. Scans are registered to maps
  /// that were made with the poses of the round before: an error of their scale fades by half a
  /// round.
  int rounds = 8;
  double settled_m = 0.005;      ///< a round that moves the nodes by less (RMS) is the last
  double residual_gate_m = 0.3;  ///< of points that count for the map's residual
};

struct TruthRound {
  MatchCount consecutive, revisit;
  int iterations = 0;
  bool converged = false;
  double moved_m = 0.0;  ///< of the nodes by this round, RMS
};

struct TruthResult {
  TruthGraph graph;
  SolvedGraph solved;
  GraphCovariance covariance;
  LadarDelay delay;
  std::vector<TruthRound> rounds;
  MapResidual residual_before;  ///< by WM's poses as it went
  MapResidual residual_after;
};

/// What the smoother is at, for a bar: a share of all of its work.
using TruthProgress = std::function<void(double)>;

/// @return an error when nothing determines the poses, or `stop` said so
[[nodiscard]] Result<TruthResult> smooth(const TruthRecording& recording,
                                         const TruthVehicle& vehicle, const TruthParams& params,
                                         const TruthProgress& progress,
                                         const std::function<bool()>& stop);

/// seen_pose() of each node.
[[nodiscard]] std::vector<Pose> seen_poses(const PoseGraph& graph, const GraphState& state);

}  // namespace rcs::smoothing

#include "tools/smoothing/reference_smoother.h"

#include <cmath>

namespace rcs::smoothing {
namespace {

constexpr double kMedianPerDof = 0.891;  // of chi squared with 6 degrees of freedom
constexpr double kMedianOfOne = 0.455;
// Matches share surfaces: agreement better than their covariances does not increase their weight.
constexpr double kMinFactor = 1.0;

double rms_between(const GraphState& a, const GraphState& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.T_world_vehicle.size(); ++k) {
    sum += (a.T_world_vehicle[k].p - b.T_world_vehicle[k].p).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(a.T_world_vehicle.size()));
}

/// The errors of matches depend on vegetation and view, those of wheels on the ground, those of the
/// motion without an INS on SP: their variances are estimated from the residuals.
bool learn_variances(const SolvedGraph& solved, PoseGraph* graph) {
  bool changed = false;
  for (const EdgeKind kind :
       {EdgeKind::kConsecutive, EdgeKind::kRevisit, EdgeKind::kWheels, EdgeKind::kMotion}) {
    const auto k = static_cast<std::size_t>(kind);
    if (solved.fit[k].edges < 20) continue;
    const double expected = kind == EdgeKind::kWheels ? kMedianOfOne : kMedianPerDof;
    double& factor = graph->variance_factor[k];
    const double now = std::max(kMinFactor, factor * solved.fit[k].median_per_dof / expected);
    changed = changed || std::abs(now / factor - 1.0) > 0.05;
    factor = now;
  }
  return changed;
}

/// Without an INS only scans determine the motion between them: each scan is a node and is matched
/// to the preceding ones.
ReferenceParams fitting(const ReferenceParams& asked, const ReferenceRecording& recording) {
  ReferenceParams params = asked;
  if (!recording.inertial.empty()) return params;
  params.nodes.spacing_s = 0.09;
  params.matching.map_spacing_m = 3.0;
  params.matching.map_reach_m = 4.0;
  params.matching.before_m = 4.5;
  params.matching.before_span_m = 12.0;
  return params;
}

}  // namespace

std::vector<Pose> seen_poses(const PoseGraph& graph, const GraphState& state) {
  std::vector<Pose> seen;
  for (std::size_t n = 0; n < state.T_world_vehicle.size(); ++n) {
    seen.push_back(seen_pose(graph, state, n));
  }
  return seen;
}

Result<ReferenceResult> smooth(const ReferenceRecording& recording, const ReferenceVehicle& vehicle,
                               const ReferenceParams& asked, const ReferenceProgress& progress,
                               const std::function<bool()>& stop) {
  const ReferenceParams params = fitting(asked, recording);
  ReferenceResult out;
  out.graph = make_reference_graph(recording, vehicle.wm.params, params.nodes);
  if (out.graph.nodes.size() < 2) return Error{"fewer than two scans within the beliefs of WM"};
  PoseGraph& graph = out.graph.graph;
  const std::vector<double>& travelled_m = out.graph.travelled_m;
  {
    const std::vector<NodeCloud> clouds =
        node_clouds(recording, out.graph, {}, vehicle.sp, params.matching);
    out.residual_before = map_residual(clouds, travelled_m, seen_poses(graph, out.graph.start),
                                       vehicle.sp, params.matching, params.residual_gate_m);
  }
  out.solved = solve(graph, out.graph.start, params.solver, stop);
  for (int round = 0; round < params.rounds && !stop(); ++round) {
    GraphState before = out.solved.state;
    out.delay = measure_ladar_delay(recording, out.graph, before);
    graph.priors.ladar_delay_s = out.delay.delay_s;
    before.shared.ladar_delay_s = out.delay.delay_s;
    const std::vector<NodeCloud> clouds =
        node_clouds(recording, out.graph, before.shared, vehicle.sp, params.matching);
    const double share = 1.0 / params.rounds;
    const Matches matches = match_nodes(
        clouds, travelled_m, seen_poses(graph, before), vehicle.sp, params.matching,
        round == 0 ? 0.3 : 0.1,
        [&](std::size_t done, std::size_t all) {
          progress(share * (round + 0.8 * static_cast<double>(done) / static_cast<double>(all)));
        },
        stop);
    if (stop()) break;
    graph.matches = matches.edges;
    preintegrate_edges(recording, before, vehicle.wm.params, &out.graph);
    out.solved = solve(graph, before, params.solver, stop);
    for (int again = 0; again < 3 && learn_variances(out.solved, &graph); ++again) {
      out.solved = solve(graph, out.solved.state, params.solver, stop);
    }
    out.rounds.push_back({matches.consecutive, matches.revisit, out.solved.iterations,
                          out.solved.converged, rms_between(before, out.solved.state)});
    progress(share * (round + 1));
    if (out.rounds.back().moved_m < params.settled_m) break;
  }
  if (stop()) return Error{"interrupted"};
  if (out.solved.singular) return Error{"the measurements do not determine the poses"};
  out.covariance = covariance(graph, out.solved, params.solver);
  if (out.covariance.pose.empty()) return Error{"the measurements do not determine the poses"};
  const std::vector<NodeCloud> clouds =
      node_clouds(recording, out.graph, out.solved.state.shared, vehicle.sp, params.matching);
  out.residual_after = map_residual(clouds, travelled_m, seen_poses(graph, out.solved.state),
                                    vehicle.sp, params.matching, params.residual_gate_m);
  return out;
}

}  // namespace rcs::smoothing

#pragma once
// Solves a pose graph: robust Gauss-Newton with a sparse Cholesky factor, and covariances from the
// factor. Pure.

#include <array>
#include <functional>
#include <vector>

#include "tools/smoothing/pose_graph.h"

namespace rcs::smoothing {

struct SolverParams {
  int max_iterations = 12;
  double step_m = 1e-4;  ///< converged if no pose moves farther
  double step_rad = 1e-6;
  /// Squared residual per degree of freedom at which the weight of a match is a quarter, of others
  /// half (Geman-McClure, Cauchy); false ones have almost no weight.
  double match_scale = 4.0;
  double other_scale = 16.0;
};

/// Statistics of the residuals of the edges of one kind.
struct KindFit {
  std::size_t edges = 0;
  double dof = 0.0;             ///< sum of their dimensions
  double chi2 = 0.0;            ///< with their robust weights
  double median_per_dof = 0.0;  ///< of the squared residuals per dimension, not weighted
  std::size_t suspect = 0;      ///< edges with a weight below a quarter
};

struct SolvedGraph {
  GraphState state;
  int iterations = 0;
  bool converged = false;
  bool singular = false;  ///< a direction is not determined; the state is of the last iteration
  std::array<KindFit, kEdgeKinds> fit{};
  std::vector<double> match_weight;  ///< robust, by match
};

/// @param stop  polled before each iteration
[[nodiscard]] SolvedGraph solve(const PoseGraph& graph, const GraphState& start,
                                const SolverParams& params, const std::function<bool()>& stop);

/// Covariances of right perturbations (rho, phi).
struct GraphCovariance {
  std::vector<Mat6> pose;        ///< of each node, absolute
  std::vector<Mat6> from_first;  ///< of T_first_node, by node
  Mat3 offset = Mat3::Zero();    ///< of the mean of all positions, world axes: the common
                                 ///< translation of the trajectory
};

/// Covariances at a solved state. Empty if singular.
[[nodiscard]] GraphCovariance covariance(const PoseGraph& graph, const SolvedGraph& solved,
                                         const SolverParams& params);

}  // namespace rcs::smoothing

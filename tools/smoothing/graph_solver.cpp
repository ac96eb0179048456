#include "tools/smoothing/graph_solver.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

#include "tools/smoothing/selected_inverse.h"

namespace rcs::smoothing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;
using Cholesky = Eigen::SimplicialLLT<Sparse, Eigen::Lower, Eigen::AMDOrdering<int>>;

bool is_match(EdgeKind kind) {
  return kind == EdgeKind::kConsecutive || kind == EdgeKind::kRevisit;
}

struct Weighed {
  double weight = 1.0;
  double cost = 0.0;
};

Weighed weigh(EdgeKind kind, double chi2, double dof, const SolverParams& p) {
  if (is_match(kind)) {
    const double c = p.match_scale * dof;
    const double share = c / (c + chi2);
    return {share * share, c * chi2 / (c + chi2)};
  }
  const bool robust = kind == EdgeKind::kGpsPosition || kind == EdgeKind::kGpsVelocity ||
                      kind == EdgeKind::kWheels || kind == EdgeKind::kMotion;
  if (!robust) return {1.0, chi2};
  const double c = p.other_scale * dof;
  return {1.0 / (1.0 + chi2 / c), c * std::log1p(chi2 / c)};
}

template <class Visit>
void for_each_edge(const PoseGraph& g, const GraphState& s, const Visit& visit) {
  for (const InertialEdge& e : g.inertial) visit(linearize(g, s, e));
  for (const MotionEdge& e : g.motion) visit(linearize(g, s, e));
  for (const GpsEdge& e : g.gps) {
    visit(linearize_position(g, s, e));
    if (e.has_velocity) visit(linearize_velocity(g, s, e));
  }
  for (const WheelEdge& e : g.wheels) visit(linearize(g, s, e));
  for (const MatchEdge& e : g.matches) visit(linearize(g, s, e));
  for (const LinearEdge& e : linearize_priors(g, s)) visit(e);
}

struct Normal {
  Sparse H;  // lower
  VectorXd g;
  double cost = 0.0;
};

void add(const LinearEdge& e, double weight, std::vector<Eigen::Triplet<double>>* entries,
         VectorXd* gradient) {
  for (const LinearEdge::Block& a : e.blocks) {
    gradient->segment(a.column, a.J.cols()) += weight * a.J.transpose() * e.r;
    for (const LinearEdge::Block& b : e.blocks) {
      if (b.column > a.column) continue;
      const MatrixXd block = weight * a.J.transpose() * b.J;
      for (int i = 0; i < block.rows(); ++i) {
        for (int j = 0; j < block.cols(); ++j) {
          const int row = a.column + i;
          const int column = b.column + j;
          if (row >= column) entries->emplace_back(row, column, block(i, j));
        }
      }
    }
  }
}

Normal normal_equations(const PoseGraph& g, const GraphState& s, const SolverParams& p) {
  Normal n;
  const int size = Columns(s).size();
  n.g = VectorXd::Zero(size);
  std::vector<Eigen::Triplet<double>> entries;
  for_each_edge(g, s, [&](const LinearEdge& e) {
    const Weighed w = weigh(e.kind, e.r.squaredNorm(), static_cast<double>(e.r.size()), p);
    n.cost += w.cost;
    add(e, w.weight, &entries, &n.g);
  });
  n.H.resize(size, size);
  n.H.setFromTriplets(entries.begin(), entries.end());
  return n;
}

double cost_of(const PoseGraph& g, const GraphState& s, const SolverParams& p) {
  double cost = 0.0;
  for_each_edge(g, s, [&](const LinearEdge& e) {
    cost += weigh(e.kind, e.r.squaredNorm(), static_cast<double>(e.r.size()), p).cost;
  });
  return cost;
}

void note_fit(const PoseGraph& g, const SolverParams& p, SolvedGraph* solved) {
  std::array<std::vector<double>, kEdgeKinds> per_dof;
  solved->match_weight.clear();
  for_each_edge(g, solved->state, [&](const LinearEdge& e) {
    const auto k = static_cast<std::size_t>(e.kind);
    const auto dof = static_cast<double>(e.r.size());
    const double chi2 = e.r.squaredNorm();
    const Weighed w = weigh(e.kind, chi2, dof, p);
    KindFit& fit = solved->fit[k];
    ++fit.edges;
    fit.dof += dof;
    fit.chi2 += w.weight * chi2;
    if (w.weight < 0.25) ++fit.suspect;
    if (is_match(e.kind)) solved->match_weight.push_back(w.weight);
    per_dof[k].push_back(chi2 / dof);
  });
  for (std::size_t k = 0; k < kEdgeKinds; ++k) {
    std::vector<double>& values = per_dof[k];
    if (values.empty()) continue;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    solved->fit[k].median_per_dof = *middle;
  }
}

bool is_small(const VectorXd& dx, const Columns& c, std::size_t nodes, const SolverParams& p) {
  for (std::size_t k = 0; k < nodes; ++k) {
    if (dx.segment<3>(c.pose(k)).norm() > p.step_m) return false;
    if (dx.segment<3>(c.pose(k) + 3).norm() > p.step_rad) return false;
  }
  return true;
}

}  // namespace

SolvedGraph solve(const PoseGraph& graph, const GraphState& start, const SolverParams& params,
                  const std::function<bool()>& stop) {
  SolvedGraph out;
  out.state = start;
  const Columns columns(start);
  Cholesky cholesky;
  bool analyzed = false;
  while (out.iterations < params.max_iterations && !out.converged && !stop()) {
    ++out.iterations;
    const Normal n = normal_equations(graph, out.state, params);
    if (!analyzed) cholesky.analyzePattern(n.H);
    analyzed = true;
    cholesky.factorize(n.H);
    if (cholesky.info() != Eigen::Success) {
      out.singular = true;
      break;
    }
    VectorXd dx = -cholesky.solve(n.g);
    if (!dx.allFinite()) {
      out.singular = true;
      break;
    }
    out.converged = is_small(dx, columns, start.T_world_vehicle.size(), params);
    // A robust cost is not convex: halve a step that increases the cost.
    GraphState next = moved(out.state, dx);
    for (int halved = 0; halved < 4 && cost_of(graph, next, params) > n.cost * (1.0 + 1e-9);
         ++halved) {
      dx *= 0.5;
      next = moved(out.state, dx);
    }
    out.state = next;
  }
  note_fit(graph, params, &out);
  return out;
}

GraphCovariance covariance(const PoseGraph& graph, const SolvedGraph& solved,
                           const SolverParams& params) {
  GraphCovariance out;
  const Normal n = normal_equations(graph, solved.state, params);
  const Cholesky cholesky(n.H);
  if (cholesky.info() != Eigen::Success) return out;
  const Sparse Z = selected_inverse(Sparse(cholesky.matrixL()));
  const auto& place = cholesky.permutationP().indices();
  const Columns c(solved.state);
  const std::vector<Pose>& T = solved.state.T_world_vehicle;

  // Covariances of the first pose, and of the mean of all positions, with all unknowns.
  MatrixXd unit = MatrixXd::Zero(c.size(), 9);
  unit.topLeftCorner<6, 6>().setIdentity();
  for (std::size_t k = 0; k < T.size(); ++k) {
    unit.block<3, 3>(c.pose(k), 6) = T[k].rotation().transpose() / static_cast<double>(T.size());
  }
  const MatrixXd with = cholesky.solve(unit);
  out.offset = unit.rightCols<3>().transpose() * with.rightCols<3>();
  for (std::size_t k = 0; k < T.size(); ++k) {
    Mat6 P;
    for (int i = 0; i < 6; ++i) {
      for (int j = 0; j < 6; ++j) {
        const int a = place[c.pose(k) + i];
        const int b = place[c.pose(k) + j];
        P(i, j) = Z.coeff(std::max(a, b), std::min(a, b));
      }
    }
    out.pose.push_back(P);
    const Mat6 cross = with.block<6, 6>(c.pose(k), 0);  // of node k and the first one
    const Mat6 A =
        adjoint(T[k].inverse() * T[0]);  // effect of the error of the first pose on T_first_k
    const Mat6 first = with.topLeftCorner<6, 6>();
    const Mat6 sum = P + A * first * A.transpose() - cross * A.transpose() - A * cross.transpose();
    out.from_first.push_back(sum);
  }
  return out;
}

}  // namespace rcs::smoothing

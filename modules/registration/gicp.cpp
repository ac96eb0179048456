#include "modules/registration/gicp.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "modules/registration/normal_equations.h"
#include "modules/registration/point_moments.h"
#include "modules/registration/voxel_sampler.h"

namespace rcs::registration {
namespace {

constexpr double kAcross_m2 = 1e-3;  // across a disc; 1 along it (the paper's epsilon)
// Neighbours whose second variance is a smaller share of the first are a scan line without a
// normal.
constexpr double kLine = 0.01;
// Lower bound of M, and its value along two discs of equal orientation. There the closest point
// follows the data, so that it adds no information.
constexpr double kAlong = 0.5;
// Final residual, in sigmas of M, of robust weight 1/4. The kernel begins as wide as the gate: a
// narrow one would hold points with errors of metres where they are.
constexpr double kKernelEnd = 2.0;
constexpr double kShrink = 0.7;             // of gate and kernel, in each iteration
constexpr std::size_t kThinned = 4;         // one point of this many is used while they shrink,
constexpr std::size_t kThinnedFrom = 2000;  // if at least this many remain

GicpPoint surface_at(const Vec3f& p, const Points& points, const KdTree::Neighbours& neighbours) {
  GicpPoint out;
  out.p = p.cast<double>();
  Moments moments;
  for (const std::uint32_t i : neighbours.index) moments.add(points[i] - p);
  if (moments.count < 3.0F) return out;
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(moments.covariance().cast<double>());
  const Vec3 variance = eigen.eigenvalues().cwiseMax(0.0);
  if (!(variance[1] > kLine * variance[2])) return out;
  out.normal = eigen.eigenvectors().col(0);
  out.angle_variance = variance[0] / (variance[1] * static_cast<double>(moments.count));
  return out;
}

struct Sums {
  NormalEquations equations;
  Mat6 along = Mat6::Zero();  // the part of H without information
  int points = 0;             // used
  int pairs = 0;
  double weight = 0.0;   // robust
  double squares = 0.0;  // robust, in sigmas
  double abs_sum = 0.0;
  double square_sum = 0.0;
};

Sums sum_pairs(const GicpCloud& model, const GicpCloud& data, const Pose& T, double gate_m,
               double kernel, std::size_t stride) {
  Sums sums;
  const Mat3 R = T.rotation();
  const auto gate2 = static_cast<float>(gate_m * gate_m);
  for (std::size_t i = 0; i < data.size(); i += stride) {
    const GicpPoint& a = data[i];
    if (a.normal.isZero(0.0)) continue;
    ++sums.points;
    const KdTree::Closest found = model.closest((R * a.p + T.p).cast<float>());
    const GicpPoint& b = model[found.index];
    if (found.distance2_m2 > gate2 || b.normal.isZero(0.0)) continue;
    const GicpTerm term = gicp_term(a, b, T);
    const Vec3 Md = term.M * term.d;
    const double u2 = term.d.dot(Md);
    const double k = 1.0 / (1.0 + u2 / (kernel * kernel));
    const double w = k * k;
    NormalEquations& e = sums.equations;
    e.H += term.J.transpose() * (w * term.M) * term.J;
    e.b += term.J.transpose() * (w * Md);
    const double stiffness = term.M.trace();
    e.weight += w * stiffness;
    const Mat6 JtJ = term.J.transpose() * term.J;
    sums.along += (w * kAlong) * JtJ;
    // M's stiff direction lies between the two normals.
    const double angle_variance = 0.25 * (a.angle_variance + b.angle_variance);
    e.noise += (w * (kAlong + stiffness * angle_variance)) * JtJ;
    ++sums.pairs;
    sums.weight += w;
    sums.squares += w * (u2 - kAlong * term.d.squaredNorm());
    const double across_m = b.normal.dot(R * term.d);
    sums.abs_sum += std::abs(across_m);
    sums.square_sum += across_m * across_m;
  }
  return sums;
}

}  // namespace

GicpCloud::GicpCloud(const Points& points, const GicpParams& params) {
  VoxelSampler().sample(points, params.voxel_m, &points_);
  if (points_.empty()) return;
  tree_.emplace(points_);
  surface_.reserve(points_.size());
  KdTree::Neighbours neighbours;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    tree_->nearest(points_[i], static_cast<std::size_t>(params.neighbours), &neighbours);
    surface_.push_back(surface_at(points_[i], points_, neighbours));
  }
}

GicpTerm gicp_term(const GicpPoint& data, const GicpPoint& model, const Pose& T) {
  const Mat3 R = T.rotation();
  GicpTerm term;
  term.d = R.transpose() * (R * data.p + T.p - model.p);
  const Vec3 n = R.transpose() * model.normal;
  const Mat3 C = 2.0 * Mat3::Identity() -
                 (1.0 - kAcross_m2) * (data.normal * data.normal.transpose() + n * n.transpose());
  term.M = C.inverse();
  term.J << Mat3::Identity(), -hat(data.p);
  return term;
}

Registration register_gicp(const GicpCloud& model, const GicpCloud& data, const Pose& guess,
                           const GicpParams& params) {
  Registration out;
  out.T_target_vehicle = guess;
  if (model.size() == 0 || data.size() == 0) return out;

  std::size_t stride = data.size() >= kThinned * kThinnedFrom ? kThinned : 1;
  Pose T = guess;
  Sums sums;
  Observability obs;
  double gate_m = std::max(params.gate_m, params.min_gate_m);
  double kernel = std::max(kKernelEnd, gate_m / std::sqrt(2.0 * kAcross_m2));
  out.stop = Stop::kMaxIterations;
  while (out.iterations < params.max_iterations) {
    sums = sum_pairs(model, data, T, gate_m, kernel, stride);
    ++out.iterations;
    if (sums.pairs * static_cast<int>(stride) < params.min_pairs) {
      out.stop = Stop::kTooFew;
      break;
    }
    obs = observability(sums.equations, params.min_alignment, params.max_sigma_m);
    const Vec6 step = observed_step(sums.equations, obs, log_se3(T.inverse() * guess));
    T = T * exp_se3(step);
    const Vec6 correction = log_se3(guess.inverse() * T);
    out.correction_m = correction.head<3>().norm();
    out.correction_rad = correction.tail<3>().norm();
    if (!T.finite() || out.correction_m > params.max_correction_m ||
        out.correction_rad > params.max_correction_rad) {
      out.stop = Stop::kDiverged;
      break;
    }
    const bool settled = gate_m == params.min_gate_m && kernel == kKernelEnd && stride == 1;
    if (settled && step.head<3>().norm() < params.min_move_m &&
        step.tail<3>().norm() < params.min_turn_rad) {
      out.stop = obs.unobserved > 0 ? Stop::kDegenerate : Stop::kConverged;
      break;
    }
    if (gate_m == params.min_gate_m && kernel == kKernelEnd) stride = 1;
    gate_m = std::max(params.min_gate_m, kShrink * gate_m);
    kernel = std::max(kKernelEnd, kShrink * kernel);
  }

  out.points = sums.points;
  out.pairs = sums.pairs;
  out.observability = obs.alignment.cwiseMin(1.0);
  if (sums.pairs > 0) {
    out.mean_distance_m = sums.abs_sum / sums.pairs;
    out.rms_m = std::sqrt(sums.square_sum / sums.pairs);
    out.overlap = static_cast<double>(sums.pairs) / sums.points;
  }
  if (!usable(out.stop)) return out;
  out.T_target_vehicle = T;
  const double variance = std::max(sums.squares / sums.weight, 1e-6);
  out.information = observed_part((sums.equations.H - sums.along) / variance, obs);
  return out;
}

Registration register_gicp(const Points& model, const Points& data, const Pose& guess,
                           const GicpParams& params) {
  return register_gicp(GicpCloud(model, params), GicpCloud(data, params), guess, params);
}

}  // namespace rcs::registration

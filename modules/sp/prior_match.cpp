#include "modules/sp/prior_match.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "modules/sp/normal_equations.h"
#include "modules/sp/voxel_key.h"

namespace rcs::sp {
namespace {

// The prediction holds so many iterations.
constexpr int kSteered = 2;
// Per iteration. Chosen with max_spread_m on both sweeps of av2_pittsburgh, 100 starts off by up to
// 3 m and 5 deg (DECISIONS 41).
constexpr double kSpreadSinks = 0.8;
// The same once a step is smaller than so many sigmas: what the spread was for has been found.
constexpr double kSettled = 0.5;
constexpr double kSpreadSinksThen = 0.3;
// A step that is not so much smaller than the one before is halved, and all that follow: the
// surface has edges between its cells, and a solution may go to and fro across one for ever.
constexpr double kShrinks = 0.7;
// A spread of less than this share of the ground's sigma is none.
constexpr double kSpreadEnds = 0.25;

struct Sums {
  NormalEquations equations;
  int pairs = 0;
  int cells = 0;
  double abs_sum = 0.0;
  double square_sum = 0.0;
};

/// @param spread_m  what residuals may have beyond the map's sigma
Sums sum(const Points& source, const ElevationMap& map, const Pose& T,
         const PriorMatchParams& params, double spread_m, PriorMatchWorkspace* ws) {
  Sums sums;
  ws->points.begin(source.size());
  ws->matches.resize(source.size());
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Vec3 q = T * source[i].cast<double>();
    PriorMatchWorkspace::Match& m = ws->matches[i];
    m.points = nullptr;
    if (!map.sample(q.x(), q.y(), &m.ground)) continue;
    const auto [points, fresh] =
        ws->points.find_or_add(pack_voxel(m.ground.cell.i, m.ground.cell.j, m.ground.level));
    m.points = points;
    ++*points;
    if (fresh) ++sums.cells;
  }
  const Mat3 R_transposed = T.rotation().transpose();
  for (std::size_t i = 0; i < source.size(); ++i) {
    const PriorMatchWorkspace::Match& m = ws->matches[i];
    if (m.points == nullptr) continue;
    const Vec3 p = source[i].cast<double>();
    const Vec3 n_world = Vec3(-m.ground.gradient.x(), -m.ground.gradient.y(), 1.0).normalized();
    const double residual = ((T * p).z() - m.ground.z_m) * n_world.z();
    const double sigma =
        std::hypot(std::max(m.ground.sigma_m, params.min_sigma_m) * n_world.z(), spread_m);
    const double u = residual / sigma;
    if (std::abs(u) > params.gate_sigma) continue;
    const double k = 1.0 + (u / params.robust_sigma) * (u / params.robust_sigma);
    const double weight = 1.0 / (k * k * sigma * sigma * *m.points);
    sums.equations.add(p, R_transposed * n_world, residual, weight);
    ++sums.pairs;
    sums.abs_sum += std::abs(residual);
    sums.square_sum += residual * residual;
  }
  sums.equations.close();
  return sums;
}

/// What residuals are expected to have at the prediction; root mean squares, of every eighth point.
struct Expected {
  double spread_m = 0.0;  ///< by the prediction's covariance
  double ground_m = 0.0;  ///< by the map's sigma
};
Expected expected_residuals(const Points& source, const ElevationMap& map,
                            const Prediction& prediction, double min_sigma_m) {
  constexpr std::size_t kStride = 8;
  const Pose& T = prediction.T_target_vehicle;
  const Mat3 R_transposed = T.rotation().transpose();
  double spread2 = 0.0, ground2 = 0.0;
  int n = 0;
  for (std::size_t i = 0; i < source.size(); i += kStride) {
    const Vec3 p = source[i].cast<double>();
    const Vec3 q = T * p;
    Elevation ground;
    if (!map.sample(q.x(), q.y(), &ground)) continue;
    const Vec3 normal =
        R_transposed * Vec3(-ground.gradient.x(), -ground.gradient.y(), 1.0).normalized();
    Vec6 J;
    J << normal, p.cross(normal);
    spread2 += J.dot(prediction.covariance * J);
    const double sigma = std::max(ground.sigma_m, min_sigma_m);
    ground2 += sigma * sigma;
    ++n;
  }
  if (n == 0) return {0.0, min_sigma_m};
  return {std::sqrt(spread2 / n), std::sqrt(ground2 / n)};
}

}  // namespace

PriorMatch match_prior_map(const Points& source_vehicle, const ElevationMap& map,
                           const Prediction& prediction, const PriorMatchParams& params,
                           WorkUnits granted, PriorMatchWorkspace* workspace) {
  PriorMatch match;
  Registration& out = match.registration;
  out.T_target_vehicle = prediction.T_target_vehicle;
  out.points = static_cast<int>(source_vehicle.size());
  out.granted = granted;
  Elevation below;
  const Vec3& p_world = prediction.T_target_vehicle.p;
  if (source_vehicle.empty() || !map.sample(p_world.x(), p_world.y(), &below)) return match;
  match.tile_id = below.tile_id;
  match.bias_sigma_m = map.level(below.level).bias_sigma_m;
  match.bias_length_m = map.level(below.level).bias_correlation_m;

  const Mat6 prior = prediction.covariance.ldlt().solve(Mat6::Identity());
  const auto cost = static_cast<WorkUnits>(source_vehicle.size());
  Pose T = prediction.T_target_vehicle;
  const Expected expected = expected_residuals(source_vehicle, map, prediction, params.min_sigma_m);
  double spread_m = std::min(expected.spread_m, params.max_spread_m);
  double damping = 1.0;
  double last_sigmas = std::numeric_limits<double>::infinity();
  Sums sums;
  Observability obs;
  out.stop = Stop::kMaxIterations;
  while (out.iterations < params.max_iterations) {
    if (out.used + cost > granted) {
      out.stop = Stop::kBudget;
      break;
    }
    if (spread_m < kSpreadEnds * expected.ground_m) spread_m = 0.0;
    sums = sum(source_vehicle, map, T, params, spread_m, workspace);
    out.used += cost;
    ++out.iterations;
    if (sums.cells < params.min_cells || sums.pairs < params.min_cells) {
      out.stop = Stop::kTooFew;
      break;
    }
    obs = observability(sums.equations, params.min_alignment, params.max_sigma_m);
    const Vec6 to_prediction = log_se3(T.inverse() * prediction.T_target_vehicle);
    const bool steered = out.iterations <= kSteered;
    const Vec6 step = steered ? steered_step(sums.equations, prior, to_prediction)
                              : observed_step(sums.equations, obs, to_prediction);
    const bool sure = !steered && spread_m == 0.0;
    const double step_sigmas = std::sqrt(step.dot(sums.equations.H * step));
    if (sure) {
      if (step_sigmas > kShrinks * last_sigmas) damping *= 0.5;
      last_sigmas = step_sigmas;
    }
    T = T * exp_se3(damping * step);
    spread_m *= !steered && step_sigmas < kSettled ? kSpreadSinksThen : kSpreadSinks;
    if (sure && damping * step_sigmas < params.step_sigma) {
      out.stop = Stop::kConverged;
      break;
    }
  }

  out.T_target_vehicle = T;
  out.pairs = sums.pairs;
  out.observability = obs.alignment.cwiseMin(1.0);
  if (sums.pairs > 0) {
    out.mean_distance_m = sums.abs_sum / sums.pairs;
    out.rms_m = std::sqrt(sums.square_sum / sums.pairs);
  }
  out.overlap = static_cast<double>(sums.pairs) / static_cast<double>(source_vehicle.size());
  const Vec6 correction = log_se3(prediction.T_target_vehicle.inverse() * T);
  out.correction_m = correction.head<3>().norm();
  out.correction_rad = correction.tail<3>().norm();
  if (!T.finite() || out.correction_m > params.max_correction_m ||
      out.correction_rad > params.max_correction_rad) {
    out.stop = Stop::kDiverged;
    out.T_target_vehicle = prediction.T_target_vehicle;
  }
  if (!usable(out.stop) || out.iterations == 0) return match;
  out.information = observed_part(sums.equations.H, obs);
  if (out.stop == Stop::kConverged && obs.unobserved > 0) out.stop = Stop::kDegenerate;
  return match;
}

}  // namespace rcs::sp

#include "modules/sp/prior/prior_match.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "modules/registration/normal_equations.h"
#include "modules/registration/voxel_key.h"
#include "rcs/terrain/slope_noise.h"

namespace rcs::sp {
namespace {

// The prediction regularizes the first iterations, up to this number.
constexpr int kSteered = 2;
// Decay of the inflation in each iteration. Chosen with max_spread_m on both sweeps of
// av2_pittsburgh, from 100 starts with errors of up to 3 m and 5 deg (ADR 41).
constexpr double kSpreadSinks = 0.8;
// Faster decay once a step is smaller than this many sigmas: the inflation is no longer needed.
constexpr double kSettled = 0.5;
constexpr double kSpreadSinksThen = 0.3;
// A step that is not smaller than the one before by this factor is halved, and all that follow: the
// surface has edges between its cells, across which a solution could oscillate forever.
constexpr double kShrinks = 0.7;
// Largest factor by which the residuals can increase the map's variance.
constexpr double kMaxScale = 16.0;
// An inflation of less than this share of the ground's sigma is set to zero.
constexpr double kSpreadEnds = 0.25;
// Cost of the search for the closest point of the map, in ground points.
constexpr WorkUnits kPointCost = 4;

/// The pose, and the depth to which light enters vegetation.
constexpr int kUnknowns = 7;
using Mat7 = Eigen::Matrix<double, kUnknowns, kUnknowns>;
using Vec7 = Eigen::Matrix<double, kUnknowns, 1>;

/// Light that enters vegetation to a depth l before it returns is measured l behind the point of
/// entry. This is no constant height above the ground: it depends on the slope towards the vehicle,
/// and pulls a match backwards. It adds l (d . n) to a residual, with d the ray's direction. Rays
/// are assumed level, from the vehicle's middle: steep rays soon reach the ground.
Vec7 distance_jacobian(const Vec3& p_vehicle, const Vec3& along_vehicle) {
  const double away = std::max(1e-9, p_vehicle.head<2>().norm());
  Vec7 J;
  J << along_vehicle, p_vehicle.cross(along_vehicle),
      p_vehicle.head<2>().dot(along_vehicle.head<2>()) / away;
  return J;
}

struct Sums {
  Mat7 H = Mat7::Zero();  ///< lower triangle: of w J J'
  Vec7 b = Vec7::Zero();
  double weight = 0.0;
  double square_u = 0.0;  ///< of residuals in sigmas, weighted
  double weight_u = 0.0;
  int pairs = 0;
  int cells = 0;
  double abs_sum = 0.0;
  double square_sum = 0.0;
};

/// The equations of the pose, after elimination of the last unknown (Schur complement).
/// @param last_information  prior information of the last unknown, about 0
registration::NormalEquations of_pose(const Mat7& H, const Vec7& b, double weight,
                                      double last_information) {
  const double last = H(6, 6) + last_information;
  const Vec6 cross = H.row(6).head<6>();
  registration::NormalEquations out;
  out.weight = weight;
  out.H = H.topLeftCorner<6, 6>();
  out.b = b.head<6>();
  if (last > 0.0) {
    out.H.triangularView<Eigen::Lower>() -= cross * cross.transpose() / last;
    out.b -= cross * (b[6] / last);
  }
  out.close();
  return out;
}

/// @param level  the finest level of the map to be used
/// @param spread_m  inflation of the residuals beyond the map's sigma
Sums sum(const Points& source, const ElevationMap& map, int level, const Pose& T,
         const PriorMatchParams& params, double spread_m, PriorMatchWorkspace* ws) {
  Sums sums;
  ws->points.begin(source.size());
  ws->matches.resize(source.size());
  for (std::size_t i = 0; i < source.size(); ++i) {
    const Vec3 q = T * source[i].cast<double>();
    PriorMatchWorkspace::Match& m = ws->matches[i];
    m.points = nullptr;
    if (!map.sample(q.x(), q.y(), &m.ground, level)) continue;
    const auto [points, fresh] = ws->points.find_or_add(
        registration::pack_voxel(m.ground.cell.i, m.ground.cell.j, m.ground.level));
    m.points = points;
    ++*points;
    if (fresh) ++sums.cells;
  }
  const Mat3 R_transposed = T.rotation().transpose();
  for (std::size_t i = 0; i < source.size(); ++i) {
    PriorMatchWorkspace::Match& m = ws->matches[i];
    m.noise = 0.0;
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
    const Vec7 J = distance_jacobian(p, R_transposed * n_world);
    sums.H.selfadjointView<Eigen::Lower>().rankUpdate(J, weight);
    sums.b += (weight * residual) * J;
    sums.weight += weight;
    const double tilt = gradient_variance(m.ground.sigma_m, map.level(m.ground.level).cell_m);
    m.noise = weight * tilt * n_world.z() * n_world.z();
    sums.square_u += weight * sigma * sigma * u * u;
    sums.weight_u += weight * sigma * sigma;
    ++sums.pairs;
    sums.abs_sum += std::abs(residual);
    sums.square_sum += residual * residual;
  }
  return sums;
}

/// Part of H due to errors of the normals: w v (Jx Jx' + Jy Jy'), where Jx is the Jacobian of a
/// normal along x of the map, summed over the matches of the last sums; lower triangle.
Mat7 normals_noise(const Points& source, const Mat3& R_vehicle_map, const PriorMatchWorkspace& ws) {
  Mat7 noise = Mat7::Zero();
  for (std::size_t i = 0; i < source.size(); ++i) {
    const double weight = ws.matches[i].noise;
    if (weight == 0.0) continue;
    for (int axis = 0; axis < 2; ++axis) {
      noise.selfadjointView<Eigen::Lower>().rankUpdate(
          distance_jacobian(source[i].cast<double>(), R_vehicle_map.col(axis)), weight);
    }
  }
  return noise;
}

/// Mean of u^2 over unit normal u under the squared robust weight, by sums over [-6, 6].
double mean_square_weighed(double robust_sigma) {
  constexpr int kSteps = 48;
  double square = 0.0, sum = 0.0;
  for (int k = 0; k <= kSteps; ++k) {
    const double u = 6.0 * k / kSteps;
    const double robust = 1.0 + (u / robust_sigma) * (u / robust_sigma);
    const double w = std::exp(-0.5 * u * u) / (robust * robust);
    square += w * u * u;
    sum += w;
  }
  return square / sum;
}

/// Expected residuals at the prediction: root mean squares over every eighth point.
struct Expected {
  double spread_m = 0.0;  ///< from the prediction's covariance
  double ground_m = 0.0;  ///< from the map's sigma
  double slope = 0.0;     ///< errors of the map's gradients, each component
  /// Variance of these errors over the one that the map's sigma states, [0, 1].
  double slope_noise = 1.0;
};

/// Gradient errors from the map's own errors. A survey may be better than stated: then its
/// gradients differ less from those of the next coarser level. Steps in the ground (kerbs) differ,
/// too, but only in few cells.
/// @return variance over the one that the map's sigma states, [0, 1]
/// @param stated2  the stated variance
double slope_noise(double stated2, std::vector<double>* differences2) {
  if (differences2->empty() || stated2 <= 0.0) return 1.0;
  const auto middle = differences2->begin() + static_cast<std::ptrdiff_t>(differences2->size() / 2);
  std::nth_element(differences2->begin(), middle, differences2->end());
  const double of_normal = 2.0 * std::log(2.0);  // median of x^2 + y^2, of unit variance each
  return std::min(1.0, *middle / of_normal / stated2);
}

Expected expected_residuals(const Points& source, const ElevationMap& map, int level,
                            const registration::Prediction& prediction, double min_sigma_m,
                            std::vector<double>* differences2) {
  constexpr std::size_t kStride = 8;
  differences2->clear();
  const Pose& T = prediction.T_target_vehicle;
  const Mat3 R_transposed = T.rotation().transpose();
  double spread2 = 0.0, ground2 = 0.0, slopes = 0.0;
  int n = 0;
  for (std::size_t i = 0; i < source.size(); i += kStride) {
    const Vec3 p = source[i].cast<double>();
    const Vec3 q = T * p;
    Elevation ground;
    if (!map.sample(q.x(), q.y(), &ground, level)) continue;
    slopes += gradient_variance(ground.sigma_m, map.level(ground.level).cell_m);
    Elevation coarser;
    if (map.sample(q.x(), q.y(), &coarser, ground.level + 1)) {
      differences2->push_back((ground.gradient - coarser.gradient).squaredNorm());
    }
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
  const double noise = slope_noise(slopes / n, differences2);
  return {std::sqrt(spread2 / n), std::sqrt(ground2 / n), std::sqrt(noise * slopes / n), noise};
}

}  // namespace

PriorMatch match_prior_map(const Points& source_vehicle, const Points& standing_vehicle,
                           const ElevationMap& map, const registration::Prediction& prediction,
                           const PriorMatchParams& params, WorkUnits granted,
                           PriorMatchWorkspace* workspace) {
  PriorMatch match;
  registration::Registration& out = match.registration;
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
  const bool with_points =
      params.points.max_points > 0 && !standing_vehicle.empty() && map.has_points();
  auto cost = static_cast<WorkUnits>(source_vehicle.size());
  if (with_points) cost += kPointCost * static_cast<WorkUnits>(standing_vehicle.size());
  workspace->standing.T_searched.reset();
  Pose T = prediction.T_target_vehicle;
  int level = 0;
  Expected expected;
  for (;; ++level) {
    expected = expected_residuals(source_vehicle, map, level, prediction, params.min_sigma_m,
                                  &workspace->differences2);
    if (expected.slope <= params.max_slope_noise || level + 1 == map.levels()) break;
  }
  if (!with_points && horizontal_sigma(prediction) > params.search_sigma_m &&
      raster_search_possible(source_vehicle, map, level, prediction, granted)) {
    out = search_raster(source_vehicle, map, level, prediction, params, &workspace->search);
    out.granted = granted;
    return match;
  }
  double spread_m = std::min(expected.spread_m, params.max_spread_m);
  // The ground's inflation hardly covers x and y, in which a trunk is displaced.
  double point_spread_m =
      with_points ? std::min(horizontal_sigma(prediction), params.max_spread_m) : 0.0;
  double damping = 1.0;
  double last_sigmas = std::numeric_limits<double>::infinity();
  const double foliage = 1.0 / (params.foliage_m * params.foliage_m);
  Sums sums;
  Mat3 R_vehicle_map = Mat3::Identity();  // of the sums
  registration::NormalEquations equations;
  PointSums points;
  registration::Observability obs;
  out.stop = registration::Stop::kMaxIterations;
  while (out.iterations < params.max_iterations) {
    if (out.used + cost > granted) {
      out.stop = registration::Stop::kBudget;
      break;
    }
    if (spread_m < kSpreadEnds * expected.ground_m) spread_m = 0.0;
    if (point_spread_m < kSpreadEnds * params.points.min_sigma_m) point_spread_m = 0.0;
    sums = sum(source_vehicle, map, level, T, params, spread_m, workspace);
    R_vehicle_map = T.rotation().transpose();
    out.used += cost;
    ++out.iterations;
    if (with_points) {
      points = sum_points(standing_vehicle, map, T, params.points, params.robust_sigma,
                          params.gate_sigma, point_spread_m, &workspace->standing);
    }
    if (sums.cells < params.min_cells || sums.pairs < params.min_cells) {
      out.stop = registration::Stop::kTooFew;
      break;
    }
    equations = of_pose(sums.H, sums.b, sums.weight, foliage);
    // These residuals do not depend on the depth in vegetation: added after its elimination.
    equations.H += points.equations.H;
    equations.b += points.equations.b;
    equations.weight += points.equations.weight;
    equations.noise += points.equations.noise;
    obs = registration::observability(equations, params.min_alignment, params.max_sigma_m);
    const Vec6 to_prediction = log_se3(T.inverse() * prediction.T_target_vehicle);
    const bool steered = out.iterations <= kSteered;
    const Vec6 step = steered ? registration::steered_step(equations, prior, to_prediction)
                              : registration::observed_step(equations, obs, to_prediction);
    const bool sure = !steered && spread_m == 0.0 && point_spread_m == 0.0;
    const double step_sigmas = std::sqrt(step.dot(equations.H * step));
    if (sure) {
      if (step_sigmas > kShrinks * last_sigmas) damping *= 0.5;
      last_sigmas = step_sigmas;
    }
    T = T * exp_se3(damping * step);
    const double sinks = !steered && step_sigmas < kSettled ? kSpreadSinksThen : kSpreadSinks;
    spread_m *= sinks;
    point_spread_m *= sinks;
    if (sure && damping * step_sigmas < params.step_sigma) {
      out.stop = registration::Stop::kConverged;
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
    out.stop = registration::Stop::kDiverged;
    out.T_target_vehicle = prediction.T_target_vehicle;
  }
  if (!registration::usable(out.stop) || out.iterations == 0) return match;
  // The residuals and the map's gradients show whether the map is as accurate as stated. If it is
  // better, its normals are, too; but no cell gets more weight than stated.
  const double expected_square = mean_square_weighed(params.robust_sigma);
  const double scale = sums.square_u / (sums.weight_u * expected_square);
  const Mat7 noise = normals_noise(source_vehicle, R_vehicle_map, *workspace);
  const Mat7 told = without_noise<kUnknowns>(sums.H, std::min(expected.slope_noise, scale) * noise);
  const double worse = std::clamp(scale, 1.0, kMaxScale);
  Mat6 information = of_pose(told / worse, Vec7::Zero(), sums.weight, foliage).H;
  if (points.weight_u > 0.0) {
    const double by_points = points.square_u / (points.weight_u * expected_square);
    information += without_noise<6>(points.equations.H, points.equations.noise) /
                   std::clamp(by_points, 1.0, kMaxScale);
  }
  out.information = registration::observed_part(information, obs);
  if (out.stop == registration::Stop::kConverged && obs.unobserved > 0) {
    out.stop = registration::Stop::kDegenerate;
  }
  return match;
}

}  // namespace rcs::sp

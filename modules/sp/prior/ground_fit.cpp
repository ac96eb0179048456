#include "modules/sp/prior/ground_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "modules/sp/prior/geman_mcclure.h"

namespace rcs::sp {
namespace {

constexpr int kPlaneSamples = 8;
constexpr int kPlaneRounds = 3;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// Half the baseline of slopes: over a single cell they would be the survey's noise.
double slope_reach(double cell_m) { return std::max(2.0 * cell_m, 3.0); }

struct Ground {
  double z_m = 0.0;
  double variance = 0.0;
  Vec2 slope = Vec2::Zero();
  double slope_variance = 0.0;  ///< of each component, from the map's noise
};

double map_variance(const Elevation& e, const ElevationMap& map, const GroundFitParams& params,
                    double radius_m) {
  const double sigma = std::max(e.sigma_m, params.min_map_sigma_m);
  const MapLevel& level = map.level(e.level);
  // The height is fitted: of the systematic error, what changes within the submap remains.
  const double bias = level.bias_sigma_m;
  const double changes = 1.0 - std::exp(-radius_m / std::max(level.bias_correlation_m, 1.0));
  return sigma * sigma + bias * bias * changes;
}

bool look(const ElevationMap& map, const GroundFitParams& params, double radius_m, const Vec2& at,
          Ground* out) {
  Elevation e;
  if (!map.sample(at.x(), at.y(), &e)) return false;
  const double h = slope_reach(map.level(e.level).cell_m);
  Elevation east, west, north, south;
  if (!map.sample(at.x() + h, at.y(), &east) || !map.sample(at.x() - h, at.y(), &west) ||
      !map.sample(at.x(), at.y() + h, &north) || !map.sample(at.x(), at.y() - h, &south)) {
    return false;
  }
  out->z_m = e.z_m;
  out->variance =
      map_variance(e, map, params, radius_m) + params.ground_sigma_m * params.ground_sigma_m;
  out->slope = Vec2(east.z_m - west.z_m, north.z_m - south.z_m) / (2.0 * h);
  const double sigma = std::max(e.sigma_m, params.min_map_sigma_m);
  out->slope_variance = sigma * sigma / (2.0 * h * h);
  return true;
}

Vec2 turned(double c, double s, const Vec3& p) {
  return {c * p.x() - s * p.y(), s * p.x() + c * p.y()};
}

/// Height of a sample for a candidate pose of the submap.
double height(const GroundSubmap::Sample& sample, const Vec2& arm, const GroundPlace& place) {
  return sample.p.z() + place.centre_map.z() + place.tilt.dot(arm);
}

/// Jacobian of the height above the map's ground: position, height, yaw and tilt.
Vec6 jacobian(const Vec2& slope, const Vec2& arm) {
  Vec6 J;
  J << -slope, 1.0, -slope.dot(Vec2(-arm.y(), arm.x())), arm;
  return J;
}

/// Prior of the tilt, and a weak prior of directions without information from the ground.
void add_priors(const GroundFitParams& params, double radius_m, Mat6* H) {
  constexpr double kHold = 1e-4;  // 1 / (100 m)^2
  const double tilt = 1.0 / (params.tilt_sigma_rad * params.tilt_sigma_rad);
  Vec6 hold;
  hold << kHold, kHold, kHold, kHold * radius_m * radius_m, tilt, tilt;
  H->diagonal() += hold;
}

void find_planes(const GroundFitParams& params, GroundSubmapWorkspace* ws, GroundSubmap* submap) {
  ws->table.begin(submap->samples.size());
  ws->planes.clear();
  ws->member.clear();
  const auto square = [&params](double v) {
    return static_cast<int>(std::floor(v / params.plane_m));
  };
  const auto middle = [&](double v) { return (square(v) + 0.5) * params.plane_m; };
  const auto terms = [&](const Vec3& p) {
    return Vec3(1.0, p.x() - middle(p.x()), p.y() - middle(p.y()));
  };
  for (GroundSubmap::Sample& s : submap->samples) {
    const auto [plane, fresh] =
        ws->table.find_or_add(registration::pack_voxel(square(s.p.x()), square(s.p.y()), 0));
    if (fresh) {
      *plane = static_cast<std::uint32_t>(ws->planes.size());
      ws->planes.emplace_back();
    }
    ws->member.push_back(*plane);
    ++ws->planes[*plane].samples;
    s.rough_m = 0.0;
  }
  for (int round = 0; round < kPlaneRounds; ++round) {
    for (GroundSubmapWorkspace::Plane& plane : ws->planes) {
      plane.A = Mat3(Vec3(1e-9, 1e-3, 1e-3).asDiagonal());
      plane.b.setZero();
    }
    for (std::size_t k = 0; k < submap->samples.size(); ++k) {
      const GroundSubmap::Sample& s = submap->samples[k];
      const Vec3 t = terms(s.p);
      const double w =
          robust_weight(s.rough_m / (2.0 * params.ground_sigma_m), params.robust_sigma);
      ws->planes[ws->member[k]].A += w * t * t.transpose();
      ws->planes[ws->member[k]].b += w * s.p.z() * t;
    }
    for (GroundSubmapWorkspace::Plane& plane : ws->planes) plane.c = plane.A.ldlt().solve(plane.b);
    for (std::size_t k = 0; k < submap->samples.size(); ++k) {
      GroundSubmap::Sample& s = submap->samples[k];
      s.rough_m = s.p.z() - ws->planes[ws->member[k]].c.dot(terms(s.p));
    }
  }
  double slope2 = 0.0, n = 0.0;
  for (std::size_t k = 0; k < submap->samples.size(); ++k) {
    const GroundSubmapWorkspace::Plane& plane = ws->planes[ws->member[k]];
    if (plane.samples < kPlaneSamples) {
      submap->samples[k].rough_m = kUnknown;
      continue;
    }
    slope2 += plane.c.tail<2>().squaredNorm();
    n += 1.0;
  }
  submap->slope = n > 0.0 ? std::sqrt(slope2 / n) : 0.0;
}

void weigh_blocks(const GroundFitParams& params, GroundSubmapWorkspace* ws, GroundSubmap* submap) {
  constexpr double kWhole = 3.0;  // samples of a block with full weight
  ws->table.begin(submap->samples.size());
  ws->counts.clear();
  ws->member.clear();
  for (const GroundSubmap::Sample& s : submap->samples) {
    const auto [block, fresh] = ws->table.find_or_add(
        registration::pack_voxel(static_cast<int>(std::floor(s.p.x() / params.block_m)),
                                 static_cast<int>(std::floor(s.p.y() / params.block_m)), 0));
    if (fresh) {
      *block = static_cast<std::uint32_t>(ws->counts.size());
      ws->counts.push_back(0);
    }
    ws->member.push_back(*block);
    ++ws->counts[*block];
  }
  submap->blocks = 0.0;
  for (std::size_t k = 0; k < submap->samples.size(); ++k) {
    const double n = ws->counts[ws->member[k]];
    submap->samples[k].weight = std::min(1.0, n / kWhole) / n;
    submap->blocks += submap->samples[k].weight;
  }
}

}  // namespace

void make_submap(const std::vector<GroundCell>& cells, std::size_t most,
                 const GroundFitParams& params, GroundSubmapWorkspace* workspace,
                 GroundSubmap* submap) {
  const std::size_t n = std::min(cells.size(), most);
  submap->samples.resize(n);
  submap->centre_level.setZero();
  submap->blocks = submap->radius_m = submap->slope = 0.0;
  if (n == 0) return;
  for (std::size_t k = 0; k < n; ++k) {
    submap->centre_level += cells[k].p_level.cast<double>() / static_cast<double>(n);
  }
  double square = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    submap->samples[k] = {cells[k].p_level.cast<double>() - submap->centre_level, 0.0, 0.0};
    square += submap->samples[k].p.head<2>().squaredNorm();
  }
  submap->radius_m = std::sqrt(square / static_cast<double>(n));
  weigh_blocks(params, workspace, submap);
  find_planes(params, workspace, submap);
}

Pose T_map_level(const GroundSubmap& submap, const GroundPlace& place) {
  const Quat q(Eigen::AngleAxisd(place.yaw_rad, Vec3::UnitZ()));
  const Quat tilted = exp_so3(Vec3(place.tilt.y(), -place.tilt.x(), 0.0)) * q;
  return {tilted, place.centre_map - tilted * submap.centre_level};
}

GroundPlace place_of(const GroundSubmap& submap, const Pose& T_map_level) {
  const double yaw_rad = yaw_of(T_map_level.q);
  const Quat q(Eigen::AngleAxisd(yaw_rad, Vec3::UnitZ()));
  const Vec3 phi = log_so3(T_map_level.q * q.conjugate());
  return {T_map_level * submap.centre_level, yaw_rad, Vec2(-phi.y(), phi.x())};
}

double rough_cost(const GroundSubmap& submap, const ElevationMap& map,
                  const GroundFitParams& params, std::size_t most, double spread_m,
                  GroundPlace* place, std::vector<double>* residuals) {
  const double c = std::cos(place->yaw_rad);
  const double s = std::sin(place->yaw_rad);
  const std::size_t n = std::min(most, submap.samples.size());
  residuals->clear();
  double variance = spread_m * spread_m + params.ground_sigma_m * params.ground_sigma_m;
  for (std::size_t k = 0; k < n; ++k) {
    const Vec2 at = place->centre_map.head<2>() + turned(c, s, submap.samples[k].p);
    Elevation e;
    if (!map.sample(at.x(), at.y(), &e)) continue;
    if (residuals->empty()) variance += map_variance(e, map, params, submap.radius_m);
    residuals->push_back(e.z_m - submap.samples[k].p.z());
  }
  if (residuals->empty() || 2 * residuals->size() < n) {
    return std::numeric_limits<double>::infinity();
  }
  const auto median = residuals->begin() + static_cast<std::ptrdiff_t>(residuals->size() / 2);
  std::nth_element(residuals->begin(), median, residuals->end());
  const double height = *median;
  place->centre_map.z() = height;
  const double sigma = std::sqrt(variance);
  double cost = 0.0;
  for (const double r : *residuals) cost += robust_cost((r - height) / sigma, params.robust_sigma);
  return cost / static_cast<double>(residuals->size());
}

double refine(const GroundSubmap& submap, const ElevationMap& map, const GroundFitParams& params,
              double spread_m, GroundPlace* place) {
  const double c = std::cos(place->yaw_rad);
  const double s = std::sin(place->yaw_rad);
  Mat6 H = Mat6::Zero();
  Vec6 g = Vec6::Zero();
  for (const GroundSubmap::Sample& sample : submap.samples) {
    const Vec2 arm = turned(c, s, sample.p);
    Ground ground;
    if (!look(map, params, submap.radius_m, place->centre_map.head<2>() + arm, &ground)) continue;
    const double variance = ground.variance + spread_m * spread_m;
    const double r = height(sample, arm, *place) - ground.z_m;
    const double w =
        sample.weight * robust_weight(r / std::sqrt(variance), params.robust_sigma) / variance;
    const Vec6 J = jacobian(ground.slope, arm);
    H += w * J * J.transpose();
    g += w * r * J;
  }
  if (!(H(2, 2) > 1.0)) return -1.0;
  add_priors(params, submap.radius_m, &H);
  g.tail<2>() += place->tilt / (params.tilt_sigma_rad * params.tilt_sigma_rad);
  const Vec6 step = -H.ldlt().solve(g);
  place->centre_map += step.head<3>();
  place->yaw_rad = wrap_angle(place->yaw_rad + step[3]);
  place->tilt += step.tail<2>();
  return std::hypot(step.head<2>().norm(), step[3] * submap.radius_m);
}

GroundVerdict judge(const GroundSubmap& submap, const ElevationMap& map,
                    const GroundFitParams& params, const GroundPlace& place) {
  GroundVerdict v;
  const double c = std::cos(place.yaw_rad);
  const double s = std::sin(place.yaw_rad);
  Mat6 H = Mat6::Zero();
  double known = 0.0;
  for (const GroundSubmap::Sample& sample : submap.samples) {
    const Vec2 arm = turned(c, s, sample.p);
    Ground ground;
    if (!look(map, params, submap.radius_m, place.centre_map.head<2>() + arm, &ground)) continue;
    known += 1.0;
    const double sigma = std::sqrt(ground.variance);
    const double u = (height(sample, arm, place) - ground.z_m) / sigma;
    const double w = sample.weight * robust_weight(u, params.robust_sigma) / ground.variance;
    const Vec6 J = jacobian(ground.slope, arm);
    H += w * J * J.transpose();
    H.diagonal().head<4>() -= w * ground.slope_variance * Vec<4>(1.0, 1.0, 0.0, arm.squaredNorm());
    if (std::isnan(sample.rough_m)) continue;
    v.blocks += sample.weight;
    v.cost += sample.weight * robust_cost(u, params.robust_sigma);
    v.plane_cost += sample.weight * robust_cost(sample.rough_m / sigma, params.robust_sigma);
  }
  v.known = submap.samples.empty() ? 0.0 : known / static_cast<double>(submap.samples.size());
  v.cost += 0.5 * place.tilt.squaredNorm() / (params.tilt_sigma_rad * params.tilt_sigma_rad);
  add_priors(params, submap.radius_m, &H);
  // Scaled to metres, so that directions with and without information are comparable.
  const double arm_m = std::max(submap.radius_m, 1.0);
  Vec6 scale;
  scale << Vec3::Ones(), Vec3::Constant(1.0 / arm_m);
  constexpr double kMin = 1e-4;  // 1 / (100 m)^2
  const Eigen::SelfAdjointEigenSolver<Mat6> axes(Mat6(scale.asDiagonal() * H * scale.asDiagonal()));
  const Vec6 variance = axes.eigenvalues().cwiseMax(kMin).cwiseInverse();
  // The sigmas are upper bounds: smaller residuals mean that map and ground are better, down to a
  // limit, because the fit itself reduces the residuals.
  constexpr double kMinShare = 0.4;
  const double share = v.blocks > 0.0 ? std::max(2.0 * v.cost / v.blocks, kMinShare) : 1.0;
  v.covariance = share * scale.asDiagonal() * axes.eigenvectors() * variance.asDiagonal() *
                 axes.eigenvectors().transpose() * scale.asDiagonal();
  return v;
}

}  // namespace rcs::sp

#include "modules/sp/prior/prior_points.h"

#include <algorithm>
#include <cmath>

#include "modules/registration/voxel_key.h"

namespace rcs::sp {
namespace {

// A surface observed at a more grazing angle may be another one: cosine.
constexpr double kFacing = 0.15;
// A smaller change of the pose keeps the matches: a tenth of the spacing of the points.
constexpr double kSame_m = 0.04;
constexpr double kSame_rad = kSame_m / 30.0;

registration::VoxelKey voxel_of(const Vec3& p, double voxel_m) {
  const Vec3 at = (p / voxel_m).array().floor();
  return registration::pack_voxel(static_cast<int>(at.x()), static_cast<int>(at.y()),
                                  static_cast<int>(at.z()));
}

bool same_place(const Pose& a, const Pose& b) {
  return (a.p - b.p).norm() < kSame_m && a.q.angularDistance(b.q) < kSame_rad;
}

}  // namespace

PointSums sum_points(const Points& standing, const ElevationMap& map, const Pose& T,
                     const PriorPointParams& params, double robust_sigma, double gate_sigma,
                     double spread_m, PriorPointsWorkspace* ws) {
  PointSums sums;
  ws->points.begin(standing.size());
  ws->matches.resize(standing.size());
  const double gate_m = params.gate_m + 2.0 * spread_m;
  const bool search = !ws->T_searched || !same_place(*ws->T_searched, T);
  if (search) ws->T_searched = T;
  const auto sigma_of = [&](const StandingHere& here) {
    return std::hypot(std::max(here.sigma_m, params.min_sigma_m), spread_m);
  };
  for (std::size_t i = 0; i < standing.size(); ++i) {
    const Vec3 q = T * standing[i].cast<double>();
    PriorPointsWorkspace::Match& m = ws->matches[i];
    m.points = nullptr;
    if (search) m.found = map.closest_point(q, gate_m, &m.here);
    if (!m.found || (q - m.here.p_m).norm() > gate_m) continue;
    if (m.here.normal.dot((T.p - q).normalized()) < kFacing) continue;
    if (std::abs(m.here.normal.dot(q - m.here.p_m)) > gate_sigma * sigma_of(m.here)) continue;
    const auto [points, fresh] = ws->points.find_or_add(voxel_of(q, params.voxel_m));
    m.points = points;
    ++*points;
    if (fresh) ++sums.voxels;
  }
  if (sums.voxels < params.min_voxels) return sums;
  const Mat3 R_transposed = T.rotation().transpose();
  const double tilt2 = params.normal_sigma_rad * params.normal_sigma_rad;
  for (std::size_t i = 0; i < standing.size(); ++i) {
    const PriorPointsWorkspace::Match& m = ws->matches[i];
    if (m.points == nullptr) continue;
    const Vec3 p = standing[i].cast<double>();
    const double residual = m.here.normal.dot(T * p - m.here.p_m);
    const double sigma = sigma_of(m.here);
    const double u = residual / sigma;
    const double k = 1.0 + (u / robust_sigma) * (u / robust_sigma);
    const double weight = 1.0 / (k * k * sigma * sigma * *m.points);
    const Vec3 normal = R_transposed * m.here.normal;
    sums.equations.add(p, normal, residual, weight);
    // The two directions in which an error of the normal turns it.
    const Vec3 across = normal.unitOrthogonal();
    for (const Vec3& turned : {across, Vec3(normal.cross(across))}) {
      Vec6 J;
      J << turned, p.cross(turned);
      sums.equations.noise.selfadjointView<Eigen::Lower>().rankUpdate(J, weight * tilt2);
    }
    sums.square_u += weight * sigma * sigma * u * u;
    sums.weight_u += weight * sigma * sigma;
  }
  sums.equations.close();
  return sums;
}

}  // namespace rcs::sp

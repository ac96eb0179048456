#include "rcs/terrain/localizability.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "rcs/base/check.h"
#include "rcs/terrain/slope_noise.h"

namespace rcs {
namespace {

using Mat4 = Eigen::Matrix4d;  // of the position error and its growth per metre

double worst_of(const Eigen::Matrix2d& P) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(P, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
}

Mat4 driven(const Mat4& P, double travelled_m) {
  Mat4 F = Mat4::Identity();
  F.topRightCorner<2, 2>() = travelled_m * Eigen::Matrix2d::Identity();
  return F * P * F.transpose();
}

// Fuses a measurement of the position whose information may be singular.
Mat4 fused(const Mat4& P, const Eigen::Matrix2d& information) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(information);
  Mat4 out = P;
  for (int k = 0; k < 2; ++k) {
    const double lambda = eigen.eigenvalues()[k];
    if (lambda <= 0.0) continue;
    Eigen::Vector4d h = Eigen::Vector4d::Zero();
    h.head<2>() = eigen.eigenvectors().col(k);
    const Eigen::Vector4d Ph = out * h;
    out -= Ph * Ph.transpose() / (h.dot(Ph) + 1.0 / lambda);
  }
  return 0.5 * (out + out.transpose());
}

}  // namespace

Eigen::Matrix2d terrain_information(const ElevationMap& map, const Vec2& place_m,
                                    const LocalizabilityParams& params) {
  Mat6 H = Mat6::Zero();  // x, y, z, roll, pitch, yaw about the position
  Mat6 V = Mat6::Zero();  // part of H by slopes that are errors of the heights
  const int reach = static_cast<int>(params.radius_m / params.column_m);
  Elevation here;
  if (!map.sample(place_m.x(), place_m.y(), &here)) return Eigen::Matrix2d::Zero();
  for (int j = -reach; j <= reach; ++j) {
    for (int i = -reach; i <= reach; ++i) {
      const Vec2 d(i * params.column_m, j * params.column_m);
      if (d.norm() > params.radius_m) continue;
      Elevation e;
      if (!map.sample(place_m.x() + d.x(), place_m.y() + d.y(), &e)) continue;
      const double cell_m = map.level(e.level).cell_m;
      const double share = std::min(1.0, std::pow(params.column_m / cell_m, 2));
      const double sigma_m = std::max(params.min_sigma_m, e.sigma_m);
      const Vec3 p(d.x(), d.y(), e.z_m - here.z_m);
      const Vec3 normal(-e.gradient.x(), -e.gradient.y(), 1.0);
      Vec6 J;
      J << normal, p.cross(normal);
      const double weight = share / (sigma_m * sigma_m);
      H += weight * J * J.transpose();
      const double noise = weight * gradient_variance(e.sigma_m, cell_m);
      for (const Vec3& axis : {Vec3(Vec3::UnitX()), Vec3(Vec3::UnitY())}) {
        Vec6 of_axis;
        of_axis << axis, p.cross(axis);
        V += noise * of_axis * of_axis.transpose();
      }
    }
  }
  H = without_noise<6>(H, V);
  const double tilt = 1.0 / (params.tilt_sigma_rad * params.tilt_sigma_rad);
  const double heading = 1.0 / (params.heading_sigma_rad * params.heading_sigma_rad);
  H.diagonal().tail<3>() += Vec3(tilt, tilt, heading);
  H(2, 2) += 1e-12;  // keeps it regular without any height
  const Eigen::Matrix4d rest = H.bottomRightCorner<4, 4>();
  const Eigen::Matrix<double, 4, 2> cross = H.bottomLeftCorner<4, 2>();
  const Eigen::Matrix2d information =
      H.topLeftCorner<2, 2>() - cross.transpose() * rest.llt().solve(cross);
  return 0.5 * (information + information.transpose());
}

double worst_sigma_m(const Eigen::Matrix2d& information) {
  constexpr double kMin = 1e-9;  // below: a plane, up to rounding
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(information, Eigen::EigenvaluesOnly);
  const double least = eigen.eigenvalues()[0];
  return least > kMin ? 1.0 / std::sqrt(least) : std::numeric_limits<double>::infinity();
}

void PathUncertaintyWalk::begin(const std::vector<Vec2>& path_m, double step_m,
                                const DeadReckoning& motion) {
  RCS_CHECK(path_m.size() >= 2 && step_m > 0.0);
  path_m_ = path_m;
  step_m_ = step_m;
  leg_ = 0;
  leg_way_m_ = way_m_ = 0.0;
  dead_.setZero();
  dead_.diagonal().head<2>().setConstant(motion.start_sigma_m * motion.start_sigma_m);
  dead_.diagonal().tail<2>().setConstant(motion.drift * motion.drift);
  with_map_ = dead_;
  find_place();
}

// Finds the leg that contains the next position; none: the walk is over.
void PathUncertaintyWalk::find_place() {
  for (; !over(); ++leg_) {
    const Vec2 leg = path_m_[leg_ + 1] - path_m_[leg_];
    const double leg_m = leg.norm();
    if (way_m_ <= leg_way_m_ + leg_m) {
      place_m_ = path_m_[leg_] + (leg_m > 0.0 ? (way_m_ - leg_way_m_) / leg_m : 0.0) * leg;
      return;
    }
    leg_way_m_ += leg_m;
  }
}

PathUncertainty PathUncertaintyWalk::step(const Eigen::Matrix2d& information) {
  RCS_CHECK(!over());
  const double step_m = way_m_ > 0.0 ? step_m_ : 0.0;
  dead_ = driven(dead_, step_m);
  with_map_ = fused(driven(with_map_, step_m), information);
  PathUncertainty here{way_m_, place_m_, worst_of(dead_.topLeftCorner<2, 2>()),
                       worst_of(with_map_.topLeftCorner<2, 2>())};
  way_m_ += step_m_;
  find_place();
  return here;
}

std::vector<PathUncertainty> path_uncertainty_along(const ElevationMap& map,
                                                    const std::vector<Vec2>& path_m,
                                                    const DeadReckoning& motion,
                                                    const LocalizabilityParams& params) {
  PathUncertaintyWalk walk;
  walk.begin(path_m, params.radius_m, motion);
  std::vector<PathUncertainty> out;
  while (!walk.over()) {
    out.push_back(walk.step(terrain_information(map, walk.place(), params)));
  }
  return out;
}

}  // namespace rcs

#include "tools/mapping/mount_estimate.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace rcs::mapping {

void MountEstimator::add(const Vec3& p_vehicle, const Pose& T_map_vehicle,
                         const Vec6& twist_vehicle, const Vec2& gradient, double above_m,
                         double sigma_m) {
  const Vec3 p = T_map_vehicle * p_vehicle;
  // Derivative of the height above the surface by the position of the point.
  const Vec3 up_vehicle = T_map_vehicle.q.conjugate() * Vec3(-gradient.x(), -gradient.y(), 1.0);
  const Vec3 v_point = twist_vehicle.head<3>() + twist_vehicle.tail<3>().cross(p_vehicle);
  Row J;
  J << p_vehicle.cross(up_vehicle), up_vehicle.dot(v_point);
  // Returns of one scan and its neighbours share the error of the pose.
  constexpr double kShare = 300.0;
  const double w = 1.0 / (kShare * sigma_m * sigma_m);
  Sums& s = cells_.at({static_cast<int>(std::floor(p.x() / cell_m_)),
                       static_cast<int>(std::floor(p.y() / cell_m_))});
  s.w += w;
  s.wr += w * above_m;
  s.wJ += w * J;
  JJ_ += w * J * J.transpose();
  Jr_ += w * above_m * J;
}

MountError MountEstimator::solve() const {
  constexpr double kTurn = radians(0.3);  // one sigma
  constexpr double kLate_s = 0.01;
  Row prior = Row::Constant(1.0 / (kTurn * kTurn));
  prior[3] = 1.0 / (kLate_s * kLate_s);
  Eigen::Matrix4d A = JJ_;
  A.diagonal() += prior;
  Row b = -Jr_;
  cells_.for_each([&](Cell, const Sums& s) {
    if (s.w == 0.0) return;
    A -= s.wJ * s.wJ.transpose() / s.w;
    b += s.wJ * (s.wr / s.w);
  });
  const Row x = A.ldlt().solve(b);
  return {x.head<3>(), x[3]};
}

}  // namespace rcs::mapping

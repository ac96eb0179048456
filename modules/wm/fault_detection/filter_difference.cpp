#include "modules/wm/fault_detection/filter_difference.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace rcs::wm {

double largest_variance(const Mat<2, 2>& P) {
  return Eigen::SelfAdjointEigenSolver<Mat<2, 2>>(P).eigenvalues()[1];
}

double difference(const FilterState& less, const FilterState& more, double floor_m) {
  const Vec2 d = (less.belief.x.T_world_vehicle.p - more.belief.x.T_world_vehicle.p).head<2>();
  const Eigen::SelfAdjointEigenSolver<Mat<2, 2>> eigen(horizontal(less) - horizontal(more));
  const Vec2 variance = eigen.eigenvalues().cwiseMax(0.0).array() + floor_m * floor_m;
  const Vec2 along = eigen.eigenvectors().transpose() * d;
  return along.cwiseAbs2().cwiseQuotient(variance).sum();
}

double heading_difference(const FilterState& less, const FilterState& more) {
  constexpr double kFloor = 2e-3;  // [rad], for errors that are not modelled
  const double d =
      wrap_angle(yaw_of(less.belief.x.T_world_vehicle.q) - yaw_of(more.belief.x.T_world_vehicle.q));
  constexpr int kYaw = kAttitude + 2;
  const double known = less.belief.P(kYaw, kYaw) - more.belief.P(kYaw, kYaw);
  return d * d / (std::max(known, 0.0) + kFloor * kFloor);
}

double height_difference(const FilterState& a, const FilterState& b, double floor_m) {
  constexpr int kHeight = kPosition + 2;
  const double d = a.belief.x.T_world_vehicle.p.z() - b.belief.x.T_world_vehicle.p.z();
  const double variance = a.belief.P(kHeight, kHeight) + b.belief.P(kHeight, kHeight);
  return d * d / (variance + floor_m * floor_m);
}

double height_separation(const FilterState& less, const FilterState& more, double floor_m) {
  constexpr int kHeight = kPosition + 2;
  const double d = less.belief.x.T_world_vehicle.p.z() - more.belief.x.T_world_vehicle.p.z();
  const double known = less.belief.P(kHeight, kHeight) - more.belief.P(kHeight, kHeight);
  return d * d / (std::max(known, 0.0) + floor_m * floor_m);
}

double tilt_difference(const FilterState& less, const FilterState& more) {
  constexpr double kFloor = 3e-3;  // [rad], for errors that are not modelled
  const Vec3 turned =
      log_so3(less.belief.x.T_world_vehicle.q.conjugate() * more.belief.x.T_world_vehicle.q);
  double sum = 0.0;
  for (int axis = 0; axis < 2; ++axis) {
    const int k = kAttitude + axis;
    const double known = less.belief.P(k, k) - more.belief.P(k, k);
    sum += turned[axis] * turned[axis] / (std::max(known, 0.0) + kFloor * kFloor);
  }
  return sum;
}

Nis nis(const FilterState& s, const GpsFix& z, const GpsParams& params, double floor_m) {
  const Residual<3> r = gps_position(s.belief.x, z, params);
  Mat3 S = r.H * s.belief.P * r.H.transpose() + r.R;
  S.diagonal().array() += floor_m * floor_m;
  const Mat<2, 2> S_h = S.topLeftCorner<2, 2>();
  const Vec2 r_h = r.r.head<2>();
  Nis out;
  out.horizontal = r_h.dot(S_h.llt().solve(r_h));
  out.vertical = r.r[2] * r.r[2] / S(2, 2);
  out.sigma_m = std::sqrt(largest_variance(S_h));
  return out;
}

}  // namespace rcs::wm

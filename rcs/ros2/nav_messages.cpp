#include "rcs/ros2/nav_messages.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "lcmtypes/convert.h"
#include "lcmtypes/plausible.h"

namespace rcs::ros2 {
namespace {

struct Poses {
  Pose T_world_vehicle;
  Pose T_local_vehicle;
};

std::optional<Poses> poses_of(const nav_state_t& m) {
  Poses poses;
  if (m.pose_valid == 0 || !plausible_motion(m) ||
      !from_message(m.q_world_vehicle, m.p_world_vehicle_m, &poses.T_world_vehicle) ||
      !from_message(m.q_local_vehicle, m.p_local_vehicle_m, &poses.T_local_vehicle) ||
      !from_message<6>(m.cov_world_pose).allFinite() ||
      !from_message<3>(m.cov_v_world).allFinite()) {
    return std::nullopt;
  }
  return poses;
}

enum MarkerType : std::int32_t { kSphere = 2, kCylinder = 3 };
enum MarkerAction : std::int32_t { kAdd = 0, kDelete = 2 };

msg::Marker marker(const msg::Header& header, const char* name, const msg::ColorRgba& color) {
  msg::Marker m;
  m.header = header;
  m.ns = name;
  m.color = color;
  return m;
}

/// @param cov  of the position, in the axes of the map
void set_ellipsoid(const Vec3& p, const Mat3& cov, msg::Marker* m) {
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(0.5 * (cov + cov.transpose()));
  Mat3 axes = solver.eigenvectors();
  if (axes.determinant() < 0.0) axes.col(0) = -axes.col(0);
  constexpr double kThinnest_m = 1e-3;  // a viewer rejects a scale of 0
  const auto diameter = [&](int k) {
    return std::max(kThinnest_m, 2.0 * 3.0 * std::sqrt(std::max(0.0, solver.eigenvalues()[k])));
  };
  m->type = kSphere;
  m->pose = to_pose({Quat(axes).normalized(), p});
  m->scale = {diameter(0), diameter(1), diameter(2)};
}

}  // namespace

std::optional<NavMessages> to_nav(const nav_state_t& m, const ClockOffsets& clocks,
                                  const std::optional<Pose>& T_vehicle_ladar) {
  const std::optional<Poses> poses = poses_of(m);
  if (!poses) return std::nullopt;
  const msg::Time stamp = to_time(shifted(m.utime, clocks.sensor_us));
  NavMessages out;
  out.pose.header = {stamp, kMapFrame};
  out.pose.pose = {
      to_pose(poses->T_world_vehicle),
      fixed_axes_covariance(poses->T_world_vehicle, from_message<6>(m.cov_world_pose))};

  out.odometry.header = out.pose.header;
  out.odometry.child_frame_id = kBaseFrame;
  out.odometry.pose = out.pose.pose;
  const Mat3 R_vehicle_world = poses->T_world_vehicle.rotation().transpose();
  const Mat3 cov_v = R_vehicle_world * from_message<3>(m.cov_v_world) * R_vehicle_world.transpose();
  msg::TwistWithCovariance& twist = out.odometry.twist;
  twist.twist.linear = to_vector3(R_vehicle_world * from_message(m.v_world_mps));
  twist.twist.angular = to_vector3(from_message(m.rate_vehicle_radps));
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      twist.covariance[static_cast<std::size_t>(6 * i + j)] = cov_v(i, j);
    }
    twist.covariance[static_cast<std::size_t>(7 * (i + 3))] = kUnknownVariance;
  }

  std::vector<msg::TransformStamped>& tf = out.tf.transforms;
  const Pose T_world_local = poses->T_world_vehicle * poses->T_local_vehicle.inverse();
  tf.push_back(to_transform(stamp, kMapFrame, kOdomFrame, T_world_local));
  tf.push_back(to_transform(stamp, kOdomFrame, kBaseFrame, poses->T_local_vehicle));
  Pose T_rolling_vehicle;
  if (m.rolling_valid != 0 &&
      from_message(m.q_rolling_vehicle, m.p_rolling_vehicle_m, &T_rolling_vehicle)) {
    tf.push_back(to_transform(stamp, kOdomFrame, kRollingFrame,
                              poses->T_local_vehicle * T_rolling_vehicle.inverse()));
  }
  if (T_vehicle_ladar) {
    tf.push_back(to_transform(stamp, kBaseFrame, kLadarFrame, *T_vehicle_ladar));
  }
  return out;
}

std::optional<msg::Path> to_path(const plan_t& m, const ClockOffsets& clocks) {
  msg::Path out;
  out.header = {to_time(shifted(m.utime, clocks.node_us)), kOdomFrame};
  out.poses.reserve(m.point.size());
  for (const plan_point_t& point : m.point) {
    const Vec3 p = from_message(point.p_m);
    if (!within(p, kFarthest_m) || !std::isfinite(point.yaw_rad)) return std::nullopt;
    const Quat q(std::cos(0.5 * point.yaw_rad), 0.0, 0.0, std::sin(0.5 * point.yaw_rad));
    out.poses.push_back(
        {{to_time(shifted(point.utime, clocks.node_us)), kOdomFrame}, to_pose({q, p})});
  }
  return out;
}

std::optional<msg::MarkerArray> to_bounds(const nav_state_t& nav, const integrity_t& integrity,
                                          const ClockOffsets& clocks) {
  const std::optional<Poses> poses = poses_of(nav);
  if (!poses) return std::nullopt;
  const msg::Header header = {to_time(shifted(nav.utime, clocks.sensor_us)), kMapFrame};
  msg::MarkerArray out;
  msg::Marker sigma = marker(header, "3_sigma", {0.1F, 0.4F, 1.0F, 0.35F});
  const Mat3 R = poses->T_world_vehicle.rotation();
  const Mat6 cov = from_message<6>(nav.cov_world_pose);
  set_ellipsoid(poses->T_world_vehicle.p, R * cov.topLeftCorner<3, 3>() * R.transpose(), &sigma);
  out.markers.push_back(sigma);

  msg::Marker level = marker(header, "protection_level", {1.0F, 0.5F, 0.0F, 0.2F});
  const double horizontal_m = integrity.protection_horizontal_m;
  const double vertical_m = integrity.protection_vertical_m;
  const bool bounded = integrity.validity == integrity_t::VALID_WORLD && horizontal_m > 0.0 &&
                       horizontal_m < kFarthest_m && vertical_m > 0.0 && vertical_m < kFarthest_m;
  level.type = kCylinder;
  level.action = bounded ? kAdd : kDelete;
  if (bounded) {
    level.pose = to_pose({Quat::Identity(), poses->T_world_vehicle.p});
    level.scale = {2.0 * horizontal_m, 2.0 * horizontal_m, 2.0 * vertical_m};
  }
  out.markers.push_back(level);
  return out;
}

}  // namespace rcs::ros2

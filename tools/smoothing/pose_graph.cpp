#include "tools/smoothing/pose_graph.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>

namespace rcs::smoothing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// W with W^T W = information, also for singular information.
MatrixXd root(const MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(information);
  return eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         eigen.eigenvectors().transpose();
}

void whiten(const MatrixXd& W, LinearEdge* e) {
  e->r = W * e->r;
  for (LinearEdge::Block& b : e->blocks) b.J = W * b.J;
}

double root_factor(const PoseGraph& g, EdgeKind kind) {
  return 1.0 / std::sqrt(g.variance_factor[static_cast<std::size_t>(kind)]);
}

LinearEdge single(int column, const VectorXd& value, double sigma) {
  LinearEdge e;
  e.r = value / sigma;
  e.blocks.push_back({column, MatrixXd::Identity(value.size(), value.size()) / sigma});
  return e;
}

LinearEdge wander(int from, int to, const Vec3& step, const Vec3& sigma, double keeps) {
  LinearEdge e;
  const MatrixXd W = Mat3(sigma.cwiseInverse().asDiagonal());
  e.r = W * step;
  e.blocks.push_back({from, -keeps * W});
  e.blocks.push_back({to, W});
  return e;
}

/// exp(twist * delay): motion of the vehicle from the stamp to the measurement.
Pose delayed(const PoseGraph& g, const GraphState& s, std::size_t node) {
  return exp_se3(g.twist[node] * s.shared.ladar_delay_s);
}

}  // namespace

std::string_view name_of(EdgeKind kind) {
  constexpr std::array<std::string_view, kEdgeKinds> kNames = {
      "inertial", "motion",      "gps position", "gps velocity",
      "wheels",   "consecutive", "revisit",      "prior"};
  return kNames[static_cast<std::size_t>(kind)];
}

Pose seen_pose(const PoseGraph& g, const GraphState& s, std::size_t node) {
  return s.T_world_vehicle[node] * delayed(g, s, node) * s.shared.mount;
}

LinearEdge linearize(const PoseGraph& g, const GraphState& s, const InertialEdge& e) {
  const Columns c(s);
  const Pose& a = s.T_world_vehicle[e.from];
  const Pose& b = s.T_world_vehicle[e.to];
  const Vec3& v = s.v_world[e.from];
  const double dt = e.motion.dt_s;
  InertialErrors now;
  now.gyro_bias_radps = s.gyro_bias[e.stretch];
  now.accel_bias_mps2 = s.accel_bias[e.stretch];
  now.gyro_scale = s.shared.gyro_scale;
  now.accel_gain = s.shared.accel_gain;
  const Vec<9> more = e.motion.by_errors * (as_vector(now) - as_vector(e.motion.errors)).eval();
  // Frame world rotates with the earth.
  const Vec3 fall = g.gravity_world - 2.0 * g.earth_rate_world.cross(v);
  const Mat3 Rt = a.rotation().transpose();
  const Quat earth = exp_so3(g.earth_rate_world * dt);
  const Vec3 dv = Rt * (s.v_world[e.to] - v - fall * dt);
  const Vec3 dp = Rt * (b.p - a.p - v * dt - 0.5 * dt * dt * fall);
  const Quat turn = e.motion.turn * exp_so3(more.head<3>());

  LinearEdge out;
  out.kind = EdgeKind::kInertial;
  out.r.resize(9);
  out.r.head<3>() = log_so3(turn.conjugate() * (a.q.conjugate() * earth * b.q));
  out.r.segment<3>(3) = dv - e.motion.dv - more.segment<3>(3);
  out.r.tail<3>() = dp - e.motion.dp - more.tail<3>();

  const Mat3 Jr = right_jacobian_inverse_so3(out.r.head<3>());
  MatrixXd Ja = MatrixXd::Zero(9, 6);
  Ja.block<3, 3>(0, 3) = -Jr * (b.q.conjugate() * earth.conjugate() * a.q).toRotationMatrix();
  Ja.block<3, 3>(3, 3) = hat(dv);
  Ja.block<3, 3>(6, 0) = -Mat3::Identity();
  Ja.block<3, 3>(6, 3) = hat(dp);
  const Mat3 coriolis = 2.0 * dt * hat(g.earth_rate_world);
  MatrixXd Jva = MatrixXd::Zero(9, 3);
  Jva.block<3, 3>(3, 0) = Rt * (coriolis - Mat3::Identity());
  Jva.block<3, 3>(6, 0) = dt * Rt * (0.5 * coriolis - Mat3::Identity());
  MatrixXd Jb = MatrixXd::Zero(9, 6);
  Jb.block<3, 3>(0, 3) = Jr;
  Jb.block<3, 3>(6, 0) = Rt * b.rotation();
  MatrixXd Jvb = MatrixXd::Zero(9, 3);
  Jvb.block<3, 3>(3, 0) = Rt;
  MatrixXd Je = -e.motion.by_errors;
  Je.topRows<3>() = -Jr * exp_so3(-out.r.head<3>()).toRotationMatrix() *
                    right_jacobian_so3(more.head<3>()) * e.motion.by_errors.topRows<3>();
  out.blocks = {{c.pose(e.from), Ja},
                {c.velocity(e.from), Jva},
                {c.pose(e.to), Jb},
                {c.velocity(e.to), Jvb},
                {c.gyro_bias(e.stretch), Je.leftCols<6>()},
                {c.gyro_scale(), Je.rightCols<12>()}};
  const Mat<9> P = e.motion.covariance;
  whiten(root_factor(g, out.kind) * MatrixXd(P.llt().matrixL().solve(Mat<9>::Identity())), &out);
  return out;
}

LinearEdge linearize(const PoseGraph& g, const GraphState& s, const MotionEdge& e) {
  const Columns c(s);
  const Pose T = s.T_world_vehicle[e.from].inverse() * s.T_world_vehicle[e.to];
  LinearEdge out;
  out.kind = EdgeKind::kMotion;
  out.r = log_se3(e.T_from_to.inverse() * T);
  out.blocks = {{c.pose(e.from), -adjoint(T.inverse())}, {c.pose(e.to), Mat6::Identity()}};
  whiten(root_factor(g, out.kind) * MatrixXd(e.sigma.cwiseInverse().asDiagonal()), &out);
  return out;
}

LinearEdge linearize_position(const PoseGraph& g, const GraphState& s, const GpsEdge& e) {
  const Columns c(s);
  const Pose& T = s.T_world_vehicle[e.node];
  const Mat3 R = T.rotation();
  const Vec3 p_node = e.T_node_vehicle * g.p_vehicle_antenna;
  LinearEdge out;
  out.kind = EdgeKind::kGpsPosition;
  out.r = T * p_node + s.gps_bias[e.stretch] - e.p_world_antenna;
  MatrixXd J(3, 6);
  J << R, -R * hat(p_node);
  out.blocks = {{c.pose(e.node), J}, {c.gps(e.stretch), Mat3::Identity()}};
  whiten(root_factor(g, out.kind) * MatrixXd(e.sigma_m.cwiseInverse().asDiagonal()), &out);
  return out;
}

LinearEdge linearize_velocity(const PoseGraph& g, const GraphState& s, const GpsEdge& e) {
  const Columns c(s);
  const Mat3 R = s.T_world_vehicle[e.node].rotation();
  // Velocity of the antenna, including the rotation of the vehicle.
  const Vec3 dv = e.dv_node + e.T_node_vehicle.q * e.rate_radps.cross(g.p_vehicle_antenna);
  LinearEdge out;
  out.kind = EdgeKind::kGpsVelocity;
  out.r = s.v_world[e.node] + R * dv - e.v_world;
  MatrixXd J = MatrixXd::Zero(3, 6);
  J.rightCols<3>() = -R * hat(dv);
  out.blocks = {{c.pose(e.node), J}, {c.velocity(e.node), Mat3::Identity()}};
  whiten(root_factor(g, out.kind) * MatrixXd(e.sigma_mps.cwiseInverse().asDiagonal()), &out);
  return out;
}

LinearEdge linearize(const PoseGraph& g, const GraphState& s, const WheelEdge& e) {
  const Columns c(s);
  const Mat3 Rt = s.T_world_vehicle[e.node].rotation().transpose();
  const Vec3 v = Rt * s.v_world[e.node];
  const double speed = e.ahead.dot(v) + e.ahead_dv_mps;
  const double climb = Rt.row(0).z();
  const double gain = 1.0 + s.shared.wheel_scale + s.shared.climb_slip * climb;
  LinearEdge out;
  out.kind = EdgeKind::kWheels;
  out.r = VectorXd::Constant(1, gain * speed - e.speed_mps);
  MatrixXd J = MatrixXd::Zero(1, 6);
  // Derivative of the climb: of the vertical component of the x axis.
  J.rightCols<3>() =
      gain * e.ahead.transpose() * hat(v) +
      speed * s.shared.climb_slip * Vec3::UnitX().cross(Rt * Vec3::UnitZ()).transpose();
  out.blocks = {{c.pose(e.node), J},
                {c.velocity(e.node), gain * e.ahead.transpose() * Rt},
                {c.wheel_scale(), MatrixXd::Constant(1, 1, speed)},
                {c.climb_slip(), MatrixXd::Constant(1, 1, speed * climb)}};
  whiten(MatrixXd::Constant(1, 1, root_factor(g, out.kind) / e.sigma_mps), &out);
  return out;
}

LinearEdge linearize(const PoseGraph& g, const GraphState& s, const MatchEdge& e) {
  const Columns c(s);
  const Pose T = seen_pose(g, s, e.map).inverse() * seen_pose(g, s, e.scan);
  const Mat6 back = adjoint(T.inverse());
  const Mat6 mount = adjoint(s.shared.mount.inverse());
  LinearEdge out;
  out.kind = e.revisit ? EdgeKind::kRevisit : EdgeKind::kConsecutive;
  out.r = log_se3(e.T_map_scan.inverse() * T);
  const MatrixXd J_delay = mount * g.twist[e.scan] - back * mount * g.twist[e.map];
  out.blocks = {{c.pose(e.map), -back * mount * adjoint(delayed(g, s, e.map).inverse())},
                {c.pose(e.scan), mount * adjoint(delayed(g, s, e.scan).inverse())},
                {c.mount(), Mat6::Identity() - back},
                {c.delay(), J_delay}};
  whiten(root_factor(g, out.kind) * root(e.information), &out);
  return out;
}

std::vector<LinearEdge> linearize_priors(const PoseGraph& g, const GraphState& s) {
  const Columns c(s);
  const GraphPriors& p = g.priors;
  constexpr double kNothing_mps = 1e3;  // weak prior of velocities, so that all are determined
  std::vector<LinearEdge> out;
  if (p.first_pose) {
    LinearEdge e = single(c.pose(0), log_se3(p.first_pose->inverse() * s.T_world_vehicle[0]), 1.0);
    whiten(MatrixXd(p.first_sigma.cwiseInverse().asDiagonal()), &e);
    out.push_back(e);
  }
  for (std::size_t k = 0; k < s.v_world.size(); ++k) {
    out.push_back(single(c.velocity(k), s.v_world[k], kNothing_mps));
  }
  out.push_back(single(c.gyro_bias(0), s.gyro_bias[0], p.gyro_bias_radps));
  out.push_back(single(c.accel_bias(0), s.accel_bias[0], p.accel_bias_mps2));
  for (std::size_t k = 1; k < s.gyro_bias.size(); ++k) {
    out.push_back(wander(c.gyro_bias(k - 1), c.gyro_bias(k), s.gyro_bias[k] - s.gyro_bias[k - 1],
                         Vec3::Constant(p.gyro_wander_radps), 1.0));
    out.push_back(wander(c.accel_bias(k - 1), c.accel_bias(k),
                         s.accel_bias[k] - s.accel_bias[k - 1], Vec3::Constant(p.accel_wander_mps2),
                         1.0));
  }
  for (std::size_t k = 0; k < s.gps_bias.size(); ++k) {
    const double keeps = k == 0 ? 0.0 : std::exp(-g.gps_stretch_s / p.gps_tau_s);
    const Vec3 sigma = p.gps_sigma_m * std::sqrt(1.0 - keeps * keeps);
    const std::size_t before = k == 0 ? 0 : k - 1;
    if (k == 0) {
      LinearEdge e = single(c.gps(0), s.gps_bias[0], 1.0);
      whiten(MatrixXd(sigma.cwiseInverse().asDiagonal()), &e);
      out.push_back(e);
    } else {
      out.push_back(wander(c.gps(before), c.gps(k), s.gps_bias[k] - keeps * s.gps_bias[before],
                           sigma, keeps));
    }
  }
  Vec6 mount_sigma;
  mount_sigma << Vec3::Constant(p.mount_m), Vec3::Constant(p.mount_rad);
  LinearEdge mount = single(c.mount(), log_se3(s.shared.mount), 1.0);
  whiten(MatrixXd(mount_sigma.cwiseInverse().asDiagonal()), &mount);
  out.push_back(mount);
  const auto number = [&](int column, double value, double sigma) {
    out.push_back(single(column, VectorXd::Constant(1, value), sigma));
  };
  number(c.delay(), s.shared.ladar_delay_s - p.ladar_delay_s, p.ladar_delay_sigma_s);
  out.push_back(single(c.gyro_scale(), s.shared.gyro_scale, p.gyro_scale));
  for (int k = 0; k < 9; ++k) {
    number(c.accel_gain() + k, s.shared.accel_gain(k / 3, k % 3), p.accel_gain);
  }
  number(c.wheel_scale(), s.shared.wheel_scale, p.wheel_scale);
  number(c.climb_slip(), s.shared.climb_slip, p.climb_slip);
  return out;
}

GraphState moved(const GraphState& s, const VectorXd& dx) {
  const Columns c(s);
  GraphState out = s;
  for (std::size_t k = 0; k < s.T_world_vehicle.size(); ++k) {
    out.T_world_vehicle[k] = s.T_world_vehicle[k] * exp_se3(dx.segment<6>(c.pose(k)));
    out.v_world[k] += dx.segment<3>(c.velocity(k));
  }
  for (std::size_t k = 0; k < s.gyro_bias.size(); ++k) {
    out.gyro_bias[k] += dx.segment<3>(c.gyro_bias(k));
    out.accel_bias[k] += dx.segment<3>(c.accel_bias(k));
  }
  for (std::size_t k = 0; k < s.gps_bias.size(); ++k) {
    out.gps_bias[k] += dx.segment<3>(c.gps(k));
  }
  SharedErrors& shared = out.shared;
  shared.mount = s.shared.mount * exp_se3(dx.segment<6>(c.mount()));
  shared.ladar_delay_s += dx[c.delay()];
  shared.gyro_scale += dx.segment<3>(c.gyro_scale());
  for (int k = 0; k < 9; ++k) shared.accel_gain(k / 3, k % 3) += dx[c.accel_gain() + k];
  shared.wheel_scale += dx[c.wheel_scale()];
  shared.climb_slip += dx[c.climb_slip()];
  return out;
}

}  // namespace rcs::smoothing

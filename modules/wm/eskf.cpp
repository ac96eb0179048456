#include "modules/wm/eskf.h"

#include <array>
#include <cmath>

namespace rcs::wm {
namespace {

using Mat9 = Mat<9>;

void symmetrize(Cov* P) { *P = (0.5 * (*P + P->transpose())).eval(); }

void scale_block(int index, int size, double factor, Cov* P) {
  P->middleRows(index, size) *= factor;
  P->middleCols(index, size) *= factor;
}

void add_variance(int index, int size, double variance, Cov* P) {
  P->diagonal().segment(index, size).array() += variance;
}

/// Common to both process models: states that change with time and with the distance driven.
void drive_on(double dt, double distance_m, const ProcessNoise& ins, const DriveNoise& drive,
              Belief* b) {
  NavState& x = b->x;
  Cov& P = b->P;

  add_variance(kGyroBias, 3, ins.gyro_instability * ins.gyro_instability * dt / ins.bias_time_s,
               &P);
  add_variance(kAccelBias, 3, ins.accel_instability * ins.accel_instability * dt / ins.bias_time_s,
               &P);
  add_variance(kWheelScale, 1, drive.wheel_scale * drive.wheel_scale * distance_m, &P);
  add_variance(kMount, 3, drive.mount_angle * drive.mount_angle * distance_m, &P);

  // Gauss-Markov: the stationary variance is kept, the correlation with the past decays.
  const double keep_map = std::exp(-distance_m / drive.map_length_m);
  x.map_bias *= keep_map;
  scale_block(kMapBias, 3, keep_map, &P);
  add_variance(kMapBias, 3, drive.map_sigma_m * drive.map_sigma_m * (1.0 - keep_map * keep_map),
               &P);

  const double keep_gps = std::exp(-dt / drive.gps_tau_s);
  x.gps_bias *= keep_gps;
  scale_block(kGpsBias, 3, keep_gps, &P);
  add_variance(kGpsBias, 3, 1.0 - keep_gps * keep_gps, &P);

  const double keep_slip = std::exp(-dt / drive.slip_correlation_s);
  x.slip *= keep_slip;
  scale_block(kSlip, 3, keep_slip, &P);
  add_variance(kSlip, 3, 1.0 - keep_slip * keep_slip, &P);

  if (x.map_epoch < 0) return;
  // The rolling map of SP drifts where it is written: at the vehicle. Noise at the origin of the
  // map would rotate the vehicle about a point that may be kilometres away.
  Vec6 variance;
  variance.head<3>().setConstant(drive.rolling_position * drive.rolling_position * distance_m);
  variance.tail<3>().setConstant(drive.rolling_angle * drive.rolling_angle * distance_m);
  const Mat6 A = adjoint(T_rolling_vehicle(x));
  P.block<6, 6>(kRolling, kRolling) += A * variance.asDiagonal() * A.transpose();
}

/// Propagates the covariance of (position, velocity, attitude) by A = [d9/d9 | d9/d(second block)]
/// and adds Q; all other states are unchanged.
template <int kSecond>
void propagate(const Mat9& A, const Mat<9, kSecond>& B, int second, const Mat9& Q, Cov* P) {
  Mat<9, kSize> M;
  M.noalias() = A * P->topRows<9>();
  M.noalias() += B * P->middleRows<kSecond>(second);
  Mat9 corner;
  corner.noalias() = M.leftCols<9>() * A.transpose();
  corner.noalias() += M.middleCols<kSecond>(second) * B.transpose();
  P->topRows<9>() = M;
  P->leftCols<9>() = M.transpose();
  P->topLeftCorner<9, 9>() = 0.5 * (corner + corner.transpose()) + Q;
}

}  // namespace

Mat<6, kSize> world_pose_jacobian(const NavState& x) {
  Mat<6, kSize> J = Mat<6, kSize>::Zero();
  J.block<3, 3>(0, kPosition) = x.T_world_vehicle.rotation().transpose();
  J.block<3, 3>(3, kAttitude).setIdentity();
  return J;
}

Mat<6, kSize> seen_pose_jacobian(const NavState& x) {
  const Mat3 E = exp_so3(x.mount).toRotationMatrix();
  Mat<6, kSize> J = world_pose_jacobian(x);
  J.block<3, 3>(0, kPosition) = E.transpose() * J.block<3, 3>(0, kPosition);
  J.block<3, 3>(3, kAttitude) = E.transpose();
  J.block<3, 3>(3, kMount) = right_jacobian_so3(x.mount);
  return J;
}

Mat<6, kSize> rolling_pose_jacobian(const NavState& x) {
  // (T_wr exp(d_r))^-1 T_ws exp(d_s) = T_rs exp(-Ad(T_rs^-1) d_r) exp(d_s)
  Mat<6, kSize> J = seen_pose_jacobian(x);
  J.block<6, 6>(0, kRolling) = -adjoint(T_rolling_vehicle(x).inverse());
  return J;
}

Mat6 world_pose_covariance(const Belief& b, double ins_mount_rad) {
  const Mat<6, kSize> J = world_pose_jacobian(b.x);
  Mat6 covariance = J * b.P * J.transpose();
  covariance.diagonal().tail<3>().array() += ins_mount_rad * ins_mount_rad;
  return covariance;
}

Mat6 rolling_pose_covariance(const Belief& b) {
  if (b.x.map_epoch < 0) return Mat6::Zero();
  const Mat<6, kSize> J = rolling_pose_jacobian(b.x);
  Mat6 covariance = J * b.P * J.transpose();
  // For a new map this is the difference of two large and equal matrices: rounding may make it
  // negative.
  covariance.diagonal() = covariance.diagonal().cwiseMax(0.0);
  return covariance;
}

Earth earth_at(const Geodetic& datum) {
  return {normal_gravity(datum.lat_rad, datum.height), earth_rate_world(datum.lat_rad)};
}

void Lasting::add(const ImuSample& imu, double gravity, double window_s) {
  const double dt = seconds(imu.interval);
  const double a = std::min(1.0, dt / window_s);
  yaw_rate += a * (imu.delta_angle.z() / dt - yaw_rate);
  force += a * (imu.delta_v / dt - Vec3(0.0, 0.0, gravity) - force);
}

namespace {

/// From now on the gyro bias represents the error of the rate.
void use_gyro(Belief* b) {
  if (b->x.inertial) return;
  b->x.inertial = true;
  b->P.middleRows<3>(kRate).setZero();
  b->P.middleCols<3>(kRate).setZero();
}

/// Density of the yaw noise by scale and misalignment [rad^2/s].
double yaw_density(const ProcessNoise& noise, const Lasting& lasting) {
  return 2.0 * noise.scale_and_misalignment * noise.scale_and_misalignment * noise.motion_time_s *
         lasting.yaw_rate * lasting.yaw_rate;
}

/// A body velocity that stays constant while the vehicle turns by `turn`.
/// @return Jacobian by position, velocity and attitude; `x` has the predicted velocity and pose
Mat9 keep_body_velocity(const NavState& before, const Quat& turn, double dt, NavState* x) {
  const Mat3 R = before.T_world_vehicle.rotation();
  const Mat3 E = turn.toRotationMatrix();
  const Vec3 v_vehicle = R.transpose() * before.v_world;
  x->v_world = R * (E * v_vehicle);
  x->T_world_vehicle.p += 0.5 * dt * (before.v_world + x->v_world);
  x->T_world_vehicle.q = (before.T_world_vehicle.q * turn).normalized();
  Mat9 A = Mat9::Identity();
  A.block<3, 3>(kAttitude, kAttitude) = E.transpose();
  A.block<3, 3>(kVelocity, kVelocity) = R * E * R.transpose();
  A.block<3, 3>(kVelocity, kAttitude) = R * (E * hat(v_vehicle) - hat(E * v_vehicle));
  A.block<3, 3>(kPosition, kVelocity) =
      0.5 * dt * (Mat3::Identity() + A.block<3, 3>(kVelocity, kVelocity));
  A.block<3, 3>(kPosition, kAttitude) = 0.5 * dt * A.block<3, 3>(kVelocity, kAttitude);
  return A;
}

/// Its Jacobian by the rotation vector, through that of the rotation, `Jr`.
Mat<9, 3> body_velocity_by_turn(const NavState& before, const Quat& turn, double dt,
                                const Mat3& Jr) {
  const Mat3 R = before.T_world_vehicle.rotation();
  const Vec3 v_vehicle = R.transpose() * before.v_world;
  Mat<9, 3> B;
  B.middleRows<3>(kAttitude) = Jr;
  B.middleRows<3>(kVelocity) = -(R * turn.toRotationMatrix() * hat(v_vehicle) * Jr);
  B.middleRows<3>(kPosition) = 0.5 * dt * B.middleRows<3>(kVelocity);
  return B;
}

/// White acceleration through one and two integrators.
Mat9 white_acceleration(const MotionNoise& noise, double dt) {
  const double qa = noise.acceleration * noise.acceleration;
  Mat9 Q = Mat9::Zero();
  Q.block<3, 3>(kPosition, kPosition).diagonal().setConstant(qa * dt * dt * dt / 3.0);
  Q.block<3, 3>(kPosition, kVelocity).diagonal().setConstant(qa * dt * dt / 2.0);
  Q.block<3, 3>(kVelocity, kPosition).diagonal().setConstant(qa * dt * dt / 2.0);
  Q.block<3, 3>(kVelocity, kVelocity).diagonal().setConstant(qa * dt);
  return Q;
}

}  // namespace

Belief predict(const Belief& b, const ImuSample& imu, const Earth& earth, const ProcessNoise& noise,
               const DriveNoise& drive, const Lasting& lasting) {
  const double dt = seconds(imu.stamp - b.x.stamp);
  const Mat3 R = b.x.T_world_vehicle.rotation();
  const Vec3 earth_vehicle = R.transpose() * earth.rate_world;
  const Vec3 dtheta = imu.delta_angle - (b.x.gyro_bias + earth_vehicle) * dt;
  const double ahead = imu.delta_v.x();
  const double side = imu.delta_v.y();
  const Vec3 dv =
      imu.delta_v - b.x.accel_bias * dt - b.x.cross_axis_x * ahead - b.x.cross_axis_y * side;
  const Mat3 half_turn = Mat3::Identity() + 0.5 * hat(dtheta);
  const Vec3 dv_world = R * (half_turn * dv);
  const Vec3 gravity(0.0, 0.0, -earth.gravity);

  Belief next = b;
  NavState& x = next.x;
  x.stamp = imu.stamp;
  x.v_world += dv_world + (gravity - 2.0 * earth.rate_world.cross(b.x.v_world)) * dt;
  x.T_world_vehicle.p += 0.5 * dt * (b.x.v_world + x.v_world);
  x.T_world_vehicle.q = (b.x.T_world_vehicle.q * exp_so3(dtheta)).normalized();
  x.rate_vehicle = dtheta / dt;
  use_gyro(&next);

  const Mat3 Jr = right_jacobian_so3(dtheta);
  const Mat3 dtheta_by_attitude = -dt * hat(earth_vehicle);
  const Mat3 R_hat_dv_half = 0.5 * (R * hat(dv));
  Mat9 A = Mat9::Identity();
  A.block<3, 3>(kAttitude, kAttitude) =
      exp_so3(dtheta).toRotationMatrix().transpose() + Jr * dtheta_by_attitude;
  A.block<3, 3>(kVelocity, kVelocity) -= 2.0 * dt * hat(earth.rate_world);
  A.block<3, 3>(kVelocity, kAttitude) =
      -R * hat(half_turn * dv) - R_hat_dv_half * dtheta_by_attitude;
  A.block<3, 3>(kPosition, kVelocity) =
      0.5 * dt * (Mat3::Identity() + A.block<3, 3>(kVelocity, kVelocity));
  A.block<3, 3>(kPosition, kAttitude) = 0.5 * dt * A.block<3, 3>(kVelocity, kAttitude);
  Mat<9, 12> B = Mat<9, 12>::Zero();  // by gyro and accelerometer bias, and by the cross-axis gains
  B.block<3, 3>(kAttitude, 0) = -dt * Jr;
  B.block<3, 3>(kVelocity, 0) = dt * R_hat_dv_half;
  B.block<3, 3>(kVelocity, 3) = -dt * (R * half_turn);
  B.block<3, 3>(kVelocity, 6) = -ahead * (R * half_turn);
  B.block<3, 3>(kVelocity, 9) = -side * (R * half_turn);
  B.block<3, 12>(kPosition, 0) = 0.5 * dt * B.block<3, 12>(kVelocity, 0);

  // An error of an increment acts as bias * dt does, so B / dt is also the Jacobian of the noise.
  const double k2 =
      2.0 * noise.scale_and_misalignment * noise.scale_and_misalignment * noise.motion_time_s;
  const double angle_density = noise.angle_random_walk * noise.angle_random_walk;
  const double velocity_density = noise.velocity_random_walk * noise.velocity_random_walk +
                                  k2 * lasting.force.z() * lasting.force.z();
  Mat9 Q;
  Q.noalias() = (angle_density / dt) * (B.leftCols<3>() * B.leftCols<3>().transpose());
  Q.noalias() += (velocity_density / dt) * (B.middleCols<3>(3) * B.middleCols<3>(3).transpose());
  Q.noalias() += (yaw_density(noise, lasting) / dt) * (B.col(2) * B.col(2).transpose());
  propagate<12>(A, B, kGyroBias, Q, &next.P);
  drive_on(dt, (x.T_world_vehicle.p - b.x.T_world_vehicle.p).norm(), noise, drive, &next);
  return next;
}

Belief predict_by_rotation(const Belief& b, const ImuSample& imu, const Earth& earth,
                           const MotionNoise& motion, const ProcessNoise& noise,
                           const DriveNoise& drive, const Lasting& lasting) {
  const double dt = seconds(imu.stamp - b.x.stamp);
  const Vec3 earth_vehicle = b.x.T_world_vehicle.rotation().transpose() * earth.rate_world;
  const Vec3 dtheta = imu.delta_angle - (b.x.gyro_bias + earth_vehicle) * dt;
  const Quat turn = exp_so3(dtheta);

  Belief next = b;
  NavState& x = next.x;
  x.stamp = imu.stamp;
  x.rate_vehicle = dtheta / dt;
  use_gyro(&next);
  const Mat<9, 3> by_turn = body_velocity_by_turn(b.x, turn, dt, right_jacobian_so3(dtheta));
  Mat9 A = keep_body_velocity(b.x, turn, dt, &x);
  A.middleCols<3>(kAttitude) -= by_turn * (dt * hat(earth_vehicle));
  const Mat<9, 3> B = -dt * by_turn;  // an error of the increment acts as -bias * dt does
  Mat9 Q = white_acceleration(motion, dt);
  const double angle_density = noise.angle_random_walk * noise.angle_random_walk;
  Q.noalias() += (angle_density / dt) * (B * B.transpose());
  Q.noalias() += (yaw_density(noise, lasting) / dt) * (B.col(2) * B.col(2).transpose());
  propagate<3>(A, B, kGyroBias, Q, &next.P);
  drive_on(dt, (x.T_world_vehicle.p - b.x.T_world_vehicle.p).norm(), noise, drive, &next);
  return next;
}

namespace {

/// A body rate over dt: first-order Gauss-Markov, exactly discretized, and its integral.
struct RateStep {
  double keep = 1.0;            ///< of the rate at the end
  double angle_per_rate = 0.0;  ///< [s]
  double angle_variance = 0.0;  ///< [rad^2]
  double covariance = 0.0;      ///< of angle and rate [rad^2/s]
  double rate_variance = 0.0;   ///< [rad^2/s^2]
};

/// @param density  of the white angular acceleration [rad/s^2/sqrt(Hz)]
RateStep rate_step(double dt, double density, double time_s) {
  const double x = dt / time_s;
  const double keep = std::exp(-x);
  const double q = density * density;
  // The closed forms suffer from cancellation for steps short against the correlation time.
  if (x < 1e-2) {
    return {keep, dt * (1.0 - 0.5 * x), q * dt * dt * dt / 3.0, q * dt * dt / 2.0, q * dt};
  }
  const double gone = 1.0 - keep;
  const double both = 1.0 - keep * keep;
  return {keep, time_s * gone,
          q * time_s * time_s * (dt - 2.0 * time_s * gone + 0.5 * time_s * both),
          0.5 * q * time_s * time_s * gone * gone, 0.5 * q * time_s * both};
}

/// About the axes of the vehicle.
std::array<RateStep, 3> rate_steps(double dt, const MotionNoise& noise) {
  const RateStep tilt = rate_step(dt, noise.angular_acceleration, noise.tilt_time_s);
  return {tilt, tilt, rate_step(dt, noise.yaw_acceleration, noise.yaw_time_s)};
}

void add_rate_noise(const std::array<RateStep, 3>& rates, Cov* P) {
  for (int i = 0; i < 3; ++i) {
    const RateStep& rate = rates[static_cast<std::size_t>(i)];
    (*P)(kAttitude + i, kRate + i) += rate.covariance;
    (*P)(kRate + i, kAttitude + i) += rate.covariance;
    (*P)(kRate + i, kRate + i) += rate.rate_variance;
  }
}

}  // namespace

Belief predict(const Belief& b, Stamp to, const MotionNoise& noise, const ProcessNoise& biases,
               const DriveNoise& drive) {
  const double dt = seconds(to - b.x.stamp);
  const std::array<RateStep, 3> rates = rate_steps(dt, noise);
  const Vec3 angle_per_rate(rates[0].angle_per_rate, rates[1].angle_per_rate,
                            rates[2].angle_per_rate);
  const Vec3 dtheta = b.x.rate_vehicle.cwiseProduct(angle_per_rate);
  const Quat turn = exp_so3(dtheta);

  Belief next = b;
  NavState& x = next.x;
  x.stamp = to;
  x.rate_vehicle = b.x.rate_vehicle.cwiseProduct(Vec3(rates[0].keep, rates[1].keep, rates[2].keep));
  x.inertial = false;
  const Mat9 A = keep_body_velocity(b.x, turn, dt, &x);
  const Mat3 Jr = right_jacobian_so3(dtheta) * angle_per_rate.asDiagonal();
  const Mat<9, 3> B = body_velocity_by_turn(b.x, turn, dt, Jr);
  Mat9 Q = white_acceleration(noise, dt);
  for (int i = 0; i < 3; ++i) {
    Q(kAttitude + i, kAttitude + i) = rates[static_cast<std::size_t>(i)].angle_variance;
  }
  propagate<3>(A, B, kRate, Q, &next.P);
  for (int i = 0; i < 3; ++i) {
    scale_block(kRate + i, 1, rates[static_cast<std::size_t>(i)].keep, &next.P);
  }
  add_rate_noise(rates, &next.P);
  drive_on(dt, (x.T_world_vehicle.p - b.x.T_world_vehicle.p).norm(), biases, drive, &next);
  return next;
}

Belief widen(const Belief& b, double time_s, const MotionNoise& usual, double rougher) {
  Belief wider = b;
  MotionNoise noise = usual;
  noise.acceleration *= rougher;
  noise.angular_acceleration *= rougher;
  noise.yaw_acceleration *= rougher;
  wider.P.topLeftCorner<9, 9>() += white_acceleration(noise, time_s);
  const std::array<RateStep, 3> rates = rate_steps(time_s, noise);
  for (int i = 0; i < 3; ++i) {
    wider.P(kAttitude + i, kAttitude + i) += rates[static_cast<std::size_t>(i)].angle_variance;
  }
  add_rate_noise(rates, &wider.P);
  return wider;
}

Belief without_gyro(const Belief& b, double yaw_rate_radps, const Vec3& sigma_radps) {
  Belief next = b;
  next.x.inertial = false;
  next.x.rate_vehicle = Vec3(0.0, 0.0, yaw_rate_radps);
  scale_block(kRate, 3, 0.0, &next.P);
  next.P.diagonal().segment<3>(kRate) = sigma_radps.cwiseAbs2();
  return next;
}

Belief start_epoch(const Belief& b, const Pose& T_rolling_vehicle, int map_epoch) {
  Belief next = b;
  next.x.map_epoch = map_epoch;
  next.x.T_world_rolling = T_world_seen(b.x) * T_rolling_vehicle.inverse();
  // T_ws exp(d_s) T_rs^-1 = T_wr exp(Ad(T_rs) d_s): the map has the error of the measured vehicle
  // pose.
  const Mat<6, kSize> J = adjoint(T_rolling_vehicle) * seen_pose_jacobian(b.x);
  const Mat<6, kSize> cross = J * b.P;
  next.P.middleRows<6>(kRolling) = cross;
  next.P.middleCols<6>(kRolling) = cross.transpose();
  next.P.block<6, 6>(kRolling, kRolling) = cross * J.transpose();
  symmetrize(&next.P);
  return next;
}

Belief start_epoch(const Belief& b, const Pose& T_rolling_vehicle, int map_epoch,
                   const Mat6& covariance) {
  Belief next = start_epoch(b, T_rolling_vehicle, map_epoch);
  const Mat6 A = adjoint(T_rolling_vehicle);
  next.P.block<6, 6>(kRolling, kRolling) += A * covariance * A.transpose();
  return next;
}

Belief move_map(const Belief& b, const Mat6& covariance) {
  Belief next = b;
  const Mat6 A = adjoint(T_rolling_vehicle(b.x));
  next.P.block<6, 6>(kRolling, kRolling) += A * covariance * A.transpose();
  return next;
}

bool at_rest(const Belief& b) {
  constexpr double kRest_mps = 0.1;
  constexpr double kSigma_mps = 0.3;
  const Vec3 variance = b.P.diagonal().segment<3>(kVelocity);
  return b.x.v_world.norm() < kRest_mps && variance.maxCoeff() < kSigma_mps * kSigma_mps;
}

Belief loosen_world(const Belief& b, const Vec3& sigma_world_m, double sigma_yaw_rad) {
  const Mat3 R_vehicle_world = b.x.T_world_vehicle.rotation().transpose();
  Mat<kSize, 4> G = Mat<kSize, 4>::Zero();  // by (shift, turn about the vertical at the vehicle)
  G.block<3, 3>(kPosition, 0).setIdentity();
  G.block<3, 1>(kVelocity, 3) = Vec3::UnitZ().cross(b.x.v_world);
  G.block<3, 1>(kAttitude, 3) = R_vehicle_world.col(2);
  if (b.x.map_epoch >= 0) {
    const Mat6 A = adjoint(T_rolling_vehicle(b.x));
    const Mat3 R_seen_world = exp_so3(b.x.mount).toRotationMatrix().transpose() * R_vehicle_world;
    G.block<6, 3>(kRolling, 0) = A.leftCols<3>() * R_seen_world;
    G.block<6, 1>(kRolling, 3) = A.rightCols<3>() * R_seen_world.col(2);
  }
  Vec<4> variance;
  variance << sigma_world_m.cwiseAbs2(), sigma_yaw_rad * sigma_yaw_rad;
  Belief next = b;
  next.P += G * variance.asDiagonal() * G.transpose();
  symmetrize(&next.P);
  return next;
}

Belief change_world(const Belief& b, const Pose& T_new_old) {
  Belief next = b;
  next.x.T_world_vehicle = T_new_old * b.x.T_world_vehicle;
  next.x.v_world = T_new_old.q * b.x.v_world;
  next.x.T_world_rolling = T_new_old * b.x.T_world_rolling;
  // Only the blocks in world axes rotate; right perturbations do not depend on frame world.
  const Mat3 R = T_new_old.rotation();
  for (const int block : {kPosition, kVelocity}) {
    next.P.middleRows<3>(block) = (R * next.P.middleRows<3>(block)).eval();
    next.P.middleCols<3>(block) = (next.P.middleCols<3>(block) * R.transpose()).eval();
  }
  symmetrize(&next.P);
  return next;
}

void renew_map_offset(double sigma_m, Belief* b) {
  b->x.map_bias.setZero();
  scale_block(kMapBias, 3, 0.0, &b->P);
  add_variance(kMapBias, 3, sigma_m * sigma_m, &b->P);
}

void renew_gps_offset(const Vec3& keep, Belief* b) {
  b->x.gps_bias = keep.cwiseProduct(b->x.gps_bias);
  for (int axis = 0; axis < 3; ++axis) {
    scale_block(kGpsBias + axis, 1, keep[axis], &b->P);
    b->P(kGpsBias + axis, kGpsBias + axis) += 1.0 - keep[axis] * keep[axis];
  }
}

}  // namespace rcs::wm

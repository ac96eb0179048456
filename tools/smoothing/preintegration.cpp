#include "tools/smoothing/preintegration.h"

#include <algorithm>

namespace rcs::smoothing {
namespace {

constexpr double kMaxGap_s = 0.03;

void step(const Vec3& rate, const Vec3& force, const Mat<6, kInertialErrors>& by_errors,
          const InertialNoise& noise, double dt, Preintegrated* sum) {
  const Vec3 phi = rate * dt;
  const Mat3 R = (sum->turn * exp_so3(0.5 * phi)).toRotationMatrix();
  Mat<9> A = Mat<9>::Identity();
  A.block<3, 3>(0, 0) = exp_so3(-phi).toRotationMatrix();
  A.block<3, 3>(3, 0) = -R * hat(force) * dt;
  A.block<3, 3>(6, 0) = 0.5 * dt * A.block<3, 3>(3, 0);
  A.block<3, 3>(6, 3) = dt * Mat3::Identity();
  Mat<9, 6> B = Mat<9, 6>::Zero();
  B.block<3, 3>(0, 0) = right_jacobian_so3(phi) * dt;
  // The force acts after half of the rotation of this step.
  B.block<3, 3>(3, 0) = -0.5 * dt * dt * R * hat(force);
  B.block<3, 3>(3, 3) = R * dt;
  B.block<3, 3>(6, 3) = 0.5 * dt * dt * R;
  sum->by_errors = A * sum->by_errors + B * by_errors;
  Vec6 density;
  density.head<3>().setConstant(noise.angle_random_walk * noise.angle_random_walk / dt);
  density.tail<3>().setConstant(noise.velocity_random_walk * noise.velocity_random_walk / dt);
  sum->covariance = A * sum->covariance * A.transpose() + B * density.asDiagonal() * B.transpose();
  sum->dp += sum->dv * dt + 0.5 * dt * dt * (R * force);
  sum->dv += R * force * dt;
  sum->turn = (sum->turn * exp_so3(phi)).normalized();
  sum->dt_s += dt;
}

}  // namespace

Vec<kInertialErrors> as_vector(const InertialErrors& e) {
  Vec<kInertialErrors> x;
  x << e.gyro_bias_radps, e.accel_bias_mps2, e.gyro_scale, e.accel_gain.row(0).transpose(),
      e.accel_gain.row(1).transpose(), e.accel_gain.row(2).transpose();
  return x;
}

Preintegrated preintegrate(const std::vector<InertialIncrement>& samples, Stamp from, Stamp to,
                           const InertialErrors& errors, const InertialNoise& noise) {
  Preintegrated sum;
  sum.errors = errors;
  Stamp covered = from;
  auto next = std::upper_bound(samples.begin(), samples.end(), from,
                               [](Stamp t, const InertialIncrement& s) { return t < s.end; });
  for (; next != samples.end() && covered < to; ++next) {
    const Stamp begin = next->end - from_seconds(next->interval_s);
    const Stamp end = std::min(next->end, to);
    if (seconds(begin - covered) > kMaxGap_s || begin >= to) break;
    // A short gap before the sample is bridged with its values.
    const double dt = seconds(end - covered);
    if (dt <= 0.0) continue;
    const Vec3 rate = next->delta_angle_rad / next->interval_s;
    const Vec3 force = next->delta_v_mps / next->interval_s;
    Mat<6, kInertialErrors> by_errors = Mat<6, kInertialErrors>::Zero();
    by_errors.block<3, 3>(0, 0) = -Mat3::Identity();
    by_errors.block<3, 3>(3, 3) = -Mat3::Identity();
    by_errors.block<3, 3>(0, 6) = -Mat3(rate.asDiagonal());
    for (int row = 0; row < 3; ++row) {
      by_errors.block<1, 3>(3 + row, 9 + 3 * row) = -force.transpose();
    }
    step(rate - errors.gyro_scale.cwiseProduct(rate) - errors.gyro_bias_radps,
         force - errors.accel_gain * force - errors.accel_bias_mps2, by_errors, noise, dt, &sum);
    covered = end;
  }
  if (seconds(to - covered) > kMaxGap_s) sum.dt_s = 0.0;
  return sum;
}

}  // namespace rcs::smoothing

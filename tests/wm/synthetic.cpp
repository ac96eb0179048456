#include "tests/wm/synthetic.h"

#include <algorithm>
#include <cmath>

namespace rcs::wm {

std::vector<Truth> make_drive(const DriveScript& s) {
  std::vector<Truth> out;
  const Duration step = from_seconds(1.0 / s.imu_hz);
  const std::size_t n = static_cast<std::size_t>(s.length_s * s.imu_hz) + 1;
  const auto attitude_at = [&s](double t) {
    const double u = std::max(0.0, std::min(t, s.brake_from_s) - s.still_s);
    const double ramp = 1.0 - std::exp(-u * u / 8.0);
    const double yaw = s.heading_rad + ramp * (0.9 * std::sin(0.21 * u) + 0.3 * std::sin(0.67 * u));
    const double edge =
        std::clamp(std::min(std::fmod(u, 5.0) - 1.0, 3.0 - std::fmod(u, 5.0)) / 0.2, 0.0, 1.0);
    const double pitch = ramp * (0.08 * std::sin(0.9 * u) + s.edge_rad * edge);
    const double roll = ramp * 0.06 * std::sin(1.3 * u + 0.5);
    return Quat(Eigen::AngleAxisd(yaw, Vec3::UnitZ()) * Eigen::AngleAxisd(pitch, Vec3::UnitY()) *
                Eigen::AngleAxisd(roll, Vec3::UnitX()));
  };
  const auto velocity_at = [&](double t) -> Vec3 {
    const double u = std::max(0.0, t - s.still_s);
    const double braked = std::clamp(1.0 - 0.5 * (t - s.brake_from_s), 0.0, 1.0);
    const double speed =
        braked * s.speed_mps * (1.0 - std::exp(-u * u / 8.0)) * (1.0 + 0.1 * std::sin(0.3 * u));
    return attitude_at(t) * Vec3(speed, 0.0, 0.0);
  };
  Vec3 p = Vec3(5.0, -3.0, 1.0);
  for (std::size_t i = 0; i < n; ++i) {
    const Stamp stamp = from_utime(1'000'000'000) + static_cast<std::int64_t>(i) * step;
    const double t = static_cast<double>(i) / s.imu_hz;
    const double dt = 1.0 / s.imu_hz;
    Truth now{stamp, {attitude_at(t), p}, velocity_at(t), Vec3::Zero()};
    now.rate_vehicle =
        log_so3(attitude_at(t - 0.5 * dt).conjugate() * attitude_at(t + 0.5 * dt)) / dt;
    if (!out.empty()) {
      now.T_world_vehicle.p =
          out.back().T_world_vehicle.p + 0.5 * dt * (out.back().v_world + now.v_world);
    }
    out.push_back(now);
  }
  return out;
}

Geodetic test_datum() { return {radians(49.0), radians(8.4), {110.0}}; }

Sensors::Sensors(const std::vector<Truth>& truth, const WmParams& params,
                 const SensorScript& script)
    : truth_(truth),
      params_(params),
      script_(script),
      random_(script.seed),
      earth_(earth_at(test_datum())),
      frame_(test_datum()) {
  gyro_bias_ = noise(params.ins.gyro_turn_on);
  accel_bias_ = noise(params.ins.accel_turn_on);
  gps_error_ = noise(script.gps_correlated * script.gps_sigma_m);
}

Vec3 Sensors::noise(double sigma) {
  std::normal_distribution<double> n(0.0, sigma);
  const double x = n(random_), y = n(random_), z = n(random_);
  return {x, y, z};
}

ImuSample Sensors::imu(std::size_t i) {
  const Truth& a = truth_[i - 1];
  const Truth& b = truth_[i];
  const Duration interval = b.stamp - a.stamp;
  const double dt = seconds(interval);
  const Mat3 R = a.T_world_vehicle.rotation();
  const Vec3 turn = log_so3(a.T_world_vehicle.q.conjugate() * b.T_world_vehicle.q);
  const Vec3 gravity(0.0, 0.0, -earth_.gravity);
  const Vec3 dv_world =
      b.v_world - a.v_world - (gravity - 2.0 * earth_.rate_world.cross(a.v_world)) * dt;
  const Mat3 half_turn = Mat3::Identity() + 0.5 * hat(turn);
  const Vec3 dv = half_turn.inverse() * (R.transpose() * dv_world);
  return {b.stamp, interval,
          turn + (R.transpose() * earth_.rate_world + gyro_bias_) * dt +
              noise(params_.ins.angle_random_walk * std::sqrt(dt)),
          dv + accel_bias_ * dt + noise(params_.ins.velocity_random_walk * std::sqrt(dt))};
}

GeodeticFix Sensors::gps(std::size_t i) {
  const double dt = seconds(truth_[i].stamp - truth_[last_gps_].stamp);
  last_gps_ = i;
  const double keep = std::exp(-dt / params_.drive.gps_tau_s);
  const double slow = script_.gps_correlated * script_.gps_sigma_m;
  gps_error_ = keep * gps_error_ + noise(slow * std::sqrt(1.0 - keep * keep));
  const double white =
      script_.gps_sigma_m * std::sqrt(1.0 - script_.gps_correlated * script_.gps_correlated);
  const Vec3 p = truth_[i].T_world_vehicle * params_.gps.lever_m + gps_error_ + noise(white);
  GeodeticFix out;
  out.antenna = frame_.to_geodetic(p);
  out.fix.sigma_m.setConstant(script_.gps_sigma_m);
  return out;
}

Vec6 Sensors::scan_noise() {
  Vec6 xi;
  xi.head<3>() = noise(script_.scan_sigma_m);
  xi.tail<3>() = noise(script_.scan_sigma_rad);
  return xi;
}

/// As published by SP: smaller by the inflation that the filter adds.
Mat6 Sensors::scan_information() const {
  const RegistrationParams& match = params_.rolling.match;
  Vec6 variance;
  variance.head<3>().setConstant((script_.scan_sigma_m * script_.scan_sigma_m) / match.inflation);
  variance.tail<3>().setConstant((script_.scan_sigma_rad * script_.scan_sigma_rad) /
                                 match.inflation);
  return variance.cwiseInverse().asDiagonal();
}

RollingMatch Sensors::scan(std::size_t i) {
  RollingMatch out;
  out.map_epoch = 1;
  const Pose& T = truth_[i].T_world_vehicle;
  if (last_scan_ == 0) {
    T_world_rolling_ = T;
    last_scan_ = i;
    out.seeded = true;
    return out;
  }
  double distance = 0.0;
  for (std::size_t k = last_scan_; k < i; ++k) {
    distance += (truth_[k + 1].T_world_vehicle.p - truth_[k].T_world_vehicle.p).norm();
  }
  last_scan_ = i;
  const DriveNoise& drive = params_.drive;
  Vec6 drift;
  drift.head<3>() = noise(drive.rolling_position * std::sqrt(distance));
  drift.tail<3>() = noise(drive.rolling_angle * std::sqrt(distance));
  const Pose T_rolling_vehicle = T_world_rolling_.inverse() * T;
  T_world_rolling_ = T * exp_se3(drift) * T_rolling_vehicle.inverse();
  out.T_rolling_vehicle = T_world_rolling_.inverse() * T * exp_se3(scan_noise());
  out.information = scan_information();
  return out;
}

PriorMatch Sensors::prior(std::size_t i, const Vec3& map_bias) {
  PriorMatch out;
  out.T_world_vehicle = truth_[i].T_world_vehicle * exp_se3(scan_noise());
  out.T_world_vehicle.p += map_bias;
  out.information = scan_information();
  return out;
}

OdometrySample Sensors::odometry(std::size_t i) {
  const Truth& t = truth_[i];
  const Vec3 v = t.T_world_vehicle.q.conjugate() * t.v_world;
  const double sigma = 0.05;
  const double climb = (t.T_world_vehicle.q * Vec3::UnitX()).z();
  const double speed = (1.0 + script_.climb_slip * climb) * v.x();
  return {speed + noise(sigma).x(), sigma, t.rate_vehicle.z() + noise(0.01).x(), 0.01};
}

}  // namespace rcs::wm

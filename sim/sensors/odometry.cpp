#include "sim/sensors/odometry.h"

namespace rcs::sim {

WheelOdometer::WheelOdometer(const OdometryParams& params, std::uint64_t seed)
    : params_(params),
      random_(seed, Stream::kOdometry),
      scale_(1.0 + (random_.uniform() < 0.5 ? -1.0 : 1.0) * params.scale_error) {}

WheelMotion WheelOdometer::measure(const Trajectory& vehicle, double end_s) {
  constexpr int kSamples = 10;
  WheelMotion mean;
  for (int k = 0; k < kSamples; ++k) {
    const Motion m = vehicle.at(end_s - params_.interval_s * (1.0 - (k + 0.5) / kSamples));
    const Vec3 ahead_world = m.T_world_vehicle.q * Vec3::UnitX();
    const double slip = params_.slip_per_grade * ahead_world.z();
    mean.speed_mps += ahead_world.dot(m.v_world) * scale_ * (1.0 + slip) / kSamples;
    mean.yaw_rate_radps += m.rate_vehicle.z() / kSamples;
  }
  // Wheels at rest have no noise.
  const bool moving = std::abs(mean.speed_mps) > 0.01;
  const double noise = random_.normal();
  const double yaw_noise = random_.normal();
  if (moving) {
    mean.speed_mps += params_.sigma_speed_mps * noise;
    mean.yaw_rate_radps += params_.sigma_yaw_rate_radps * yaw_noise;
  }
  return mean;
}

}  // namespace rcs::sim

#include "sim/vehicle/suspension.h"

#include <cmath>

namespace rcs::sim {
namespace {

Pose body(const CoursePoint& at, double height_m, double slope_ahead, double slope_left) {
  const Vec3 ahead(std::cos(at.heading_rad), std::sin(at.heading_rad), slope_ahead);
  const Vec3 left(-std::sin(at.heading_rad), std::cos(at.heading_rad), slope_left);
  const Vec3 x = ahead.normalized();
  const Vec3 z = ahead.cross(left).normalized();
  Mat3 R;
  R << x, z.cross(x), z;
  return {Quat(R), Vec3(at.p_world.x(), at.p_world.y(), height_m)};
}

}  // namespace

void Spring::step(double foot, double dt_s) {
  const double foot_rate = (foot - foot_) / dt_s;
  foot_ = foot;
  const double acceleration =
      omega_ * omega_ * (foot - value_) + 2.0 * damping_ * omega_ * (foot_rate - rate_);
  rate_ += acceleration * dt_s;
  value_ += rate_ * dt_s;
}

Suspension::Suspension(const World* world, const VehicleParams& params, const CoursePoint& at)
    : world_(world),
      params_(params),
      heave_(params.heave_hz, params.damping, footing(at).height_m),
      pitch_(params.tilt_hz, params.damping, footing(at).slope_ahead),
      roll_(params.tilt_hz, params.damping, footing(at).slope_left) {}

void Suspension::step(const CoursePoint& at) {
  const Footing foot = footing(at);
  heave_.step(foot.height_m, kStep_s);
  pitch_.step(foot.slope_ahead, kStep_s);
  roll_.step(foot.slope_left, kStep_s);
}

Pose Suspension::pose(const CoursePoint& at) const {
  return body(at, heave_.value() + params_.imu_height_m, pitch_.value(), roll_.value());
}

Suspension::Footing Suspension::footing(const CoursePoint& at) const {
  const Vec2 ahead(std::cos(at.heading_rad), std::sin(at.heading_rad));
  const Vec2 left(-ahead.y(), ahead.x());
  constexpr int kSamples = 5;  // over a wheel's contact
  const auto wheel = [&](double x_m, double y_m) {
    double sum = 0.0;
    for (int k = 0; k < kSamples; ++k) {
      const double along_m = x_m + params_.contact_m * (k / (kSamples - 1.0) - 0.5);
      const Vec2 p = at.p_world + along_m * ahead + y_m * left;
      sum += world_->height(p.x(), p.y());
    }
    return sum / kSamples;
  };
  const double x_m = 0.5 * params_.wheelbase_m;
  const double y_m = 0.5 * params_.track_m;
  const double front_left = wheel(x_m, y_m);
  const double front_right = wheel(x_m, -y_m);
  const double rear_left = wheel(-x_m, y_m);
  const double rear_right = wheel(-x_m, -y_m);
  return {0.25 * (front_left + front_right + rear_left + rear_right),
          0.5 * (front_left + front_right - rear_left - rear_right) / params_.wheelbase_m,
          0.5 * (front_left + rear_left - front_right - rear_right) / params_.track_m};
}

}  // namespace rcs::sim

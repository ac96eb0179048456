#include "sim/vehicle.h"

#include <cmath>

namespace rcs::sim {
namespace {

constexpr double kStep_s = 0.002;  // of the springs
constexpr int kStepsPerKnot = 10;  // knots of the motion every 20 ms

// One degree of freedom on a spring and a damper whose foot moves.
class Suspended {
 public:
  Suspended(double frequency_hz, double damping, double foot)
      : omega_(2.0 * kPi * frequency_hz), damping_(damping), foot_(foot), value_(foot) {}

  void step(double foot, double dt_s) {
    const double foot_rate = (foot - foot_) / dt_s;
    foot_ = foot;
    const double acceleration =
        omega_ * omega_ * (foot - value_) + 2.0 * damping_ * omega_ * (foot_rate - rate_);
    rate_ += acceleration * dt_s;
    value_ += rate_ * dt_s;
  }
  [[nodiscard]] double value() const { return value_; }

 private:
  double omega_;
  double damping_;
  double foot_;
  double value_;
  double rate_ = 0.0;
};

// The plane under the wheels.
struct Footing {
  double height_m;
  double slope_ahead;  // rise per metre forward
  double slope_left;
};

Footing footing(const CoursePoint& at, const World& world, const VehicleParams& params) {
  const Vec2 ahead(std::cos(at.heading_rad), std::sin(at.heading_rad));
  const Vec2 left(-ahead.y(), ahead.x());
  constexpr int kSamples = 5;  // over a wheel's contact
  const auto wheel = [&](double x_m, double y_m) {
    double sum = 0.0;
    for (int k = 0; k < kSamples; ++k) {
      const double along_m = x_m + params.contact_m * (k / (kSamples - 1.0) - 0.5);
      const Vec2 p = at.p_world + along_m * ahead + y_m * left;
      sum += world.height(p.x(), p.y());
    }
    return sum / kSamples;
  };
  const double x_m = 0.5 * params.wheelbase_m;
  const double y_m = 0.5 * params.track_m;
  const double front_left = wheel(x_m, y_m);
  const double front_right = wheel(x_m, -y_m);
  const double rear_left = wheel(-x_m, y_m);
  const double rear_right = wheel(-x_m, -y_m);
  return {0.25 * (front_left + front_right + rear_left + rear_right),
          0.5 * (front_left + front_right - rear_left - rear_right) / params.wheelbase_m,
          0.5 * (front_left + rear_left - front_right - rear_right) / params.track_m};
}

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

Trajectory drive(const Course& course, const World& world, const VehicleParams& params,
                 double duration_s) {
  const Footing start = footing(course.at_distance(0.0), world, params);
  Suspended heave(params.heave_hz, params.damping, start.height_m);
  Suspended pitch(params.tilt_hz, params.damping, start.slope_ahead);
  Suspended roll(params.tilt_hz, params.damping, start.slope_left);

  const auto pose = [&](double time_s) {
    return body(course.at_distance(course.distance_at(time_s)), heave.value() + params.imu_height_m,
                pitch.value(), roll.value());
  };
  const double knot_s = kStep_s * kStepsPerKnot;
  std::vector<Pose> knots = {pose(0.0), pose(0.0)};  // the motion starts at knot 1
  const int count = static_cast<int>(std::ceil(duration_s / knot_s)) + 1;
  for (int k = 1; k <= count; ++k) {
    for (int n = 1; n <= kStepsPerKnot; ++n) {
      const double time_s = (k - 1) * knot_s + n * kStep_s;
      const Footing foot = footing(course.at_distance(course.distance_at(time_s)), world, params);
      heave.step(foot.height_m, kStep_s);
      pitch.step(foot.slope_ahead, kStep_s);
      roll.step(foot.slope_left, kStep_s);
    }
    knots.push_back(pose(k * knot_s));
  }
  return Trajectory(std::move(knots), knot_s);
}

}  // namespace rcs::sim

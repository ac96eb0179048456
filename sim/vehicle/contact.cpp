#include "sim/vehicle/contact.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace rcs::sim {
namespace {

constexpr double kSpacing_m = 0.2;  // of the points under the body

}  // namespace

Contact contact(const World& world, const CoursePoint& at, const Pose& T_world_vehicle,
                const VehicleParams& vehicle, const Footprint& footprint,
                const PassableLimits& limits) {
  const Vec2 ahead(std::cos(at.heading_rad), std::sin(at.heading_rad));
  const Vec2 left(-ahead.y(), ahead.x());
  const auto ground = [&](double x_m, double y_m) {
    const Vec2 p = at.p_world + x_m * ahead + y_m * left;
    return world.height(p.x(), p.y());
  };
  Contact out;
  const double x_m = 0.5 * vehicle.wheelbase_m;
  const double y_m = 0.5 * vehicle.track_m;
  std::array<double, 4> wheels{};  // front left, front right, rear left, rear right
  for (std::size_t k = 0; k < wheels.size(); ++k) {
    const double x = k < 2 ? x_m : -x_m;
    const double y = k % 2 == 0 ? y_m : -y_m;
    wheels[k] = ground(x, y);
    const double across = std::abs(ground(x, y + kEdge_m) - ground(x, y - kEdge_m));
    const double along = std::abs(ground(x + kEdge_m, y) - ground(x - kEdge_m, y));
    out.edge = out.edge || std::max(along, across) > limits.step_m;
  }
  // Plane of the wheels.
  const double middle = 0.25 * (wheels[0] + wheels[1] + wheels[2] + wheels[3]);
  const double per_x = (wheels[0] + wheels[1] - wheels[2] - wheels[3]) / (4.0 * x_m);
  const double per_y = (wheels[0] + wheels[2] - wheels[1] - wheels[3]) / (4.0 * y_m);
  const double half_length_m = 0.5 * footprint.length_m;
  const double half_width_m = 0.5 * footprint.width_m;
  for (double x = -half_length_m; x <= half_length_m + 1e-9; x += kSpacing_m) {
    const double max_m = std::abs(x) <= x_m ? limits.belly_m : limits.bumper_m;
    for (double y = -half_width_m; y <= half_width_m + 1e-9; y += kSpacing_m) {
      out.body = out.body || ground(x, y) - (middle + per_x * x + per_y * y) > max_m;
    }
  }
  const Vec3 x_body = T_world_vehicle.q * Vec3::UnitX();
  const Vec3 y_body = T_world_vehicle.q * Vec3::UnitY();
  out.tipped = std::abs(std::asin(std::clamp(x_body.z(), -1.0, 1.0))) > limits.pitch_rad ||
               std::abs(std::asin(std::clamp(y_body.z(), -1.0, 1.0))) > limits.roll_rad;
  return out;
}

}  // namespace rcs::sim

#pragma once
// A small scene for registration tests: rolling ground, two walls and boxes, seen by an ideal
// scanner as random points of its surfaces.

#include <cmath>
#include <random>
#include <vector>

#include "modules/registration/registration.h"
#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::test {

enum class Ground { kRolling, kFlat };

inline double ground_z(Ground ground, double x, double y) {
  return ground == Ground::kFlat ? 0.0 : 0.6 * std::sin(0.25 * x) * std::cos(0.2 * y + 0.5);
}

/// `n` points around `centre` in frame rolling; noise along z of the ground and across the walls.
inline Points scene(Ground ground, bool walls, int n, double noise_m, const Vec3& centre,
                    std::mt19937* rng) {
  std::uniform_real_distribution<double> u(-1.0, 1.0);
  std::normal_distribution<double> noise(0.0, noise_m);
  Points points;
  for (int i = 0; i < n; ++i) {
    const double x = centre.x() + 25.0 * u(*rng);
    const double y = centre.y() + 25.0 * u(*rng);
    Vec3 p(x, y, ground_z(ground, x, y) + noise(*rng));
    if (walls && i % 4 == 0) p = Vec3(18.0 + noise(*rng), y, 1.5 + 1.5 * u(*rng));
    if (walls && i % 4 == 1) p = Vec3(x, -15.0 + noise(*rng), 1.5 + 1.5 * u(*rng));
    points.push_back(p.cast<float>());
  }
  return points;
}

inline Points moved(const Pose& T, const Points& points) {
  Points out;
  for (std::size_t i = 0; i < points.size(); ++i) {
    out.push_back((T * points[i].cast<double>()).cast<float>());
  }
  return out;
}

/// Degenerate clouds that do not determine a pose: empty, one point, a line, one position repeated.
inline std::vector<Points> poor_clouds() {
  std::vector<Points> clouds(4);
  clouds[1].push_back(Vec3f(1.0F, 2.0F, 3.0F));
  for (int i = 0; i < 3000; ++i) {
    clouds[2].push_back(Vec3f(0.01F * static_cast<float>(i), 0.0F, 0.0F));
    clouds[3].push_back(Vec3f(1.0F, 2.0F, 3.0F));
  }
  return clouds;
}

inline Pose pose(double x, double y, double z, double roll, double pitch, double yaw) {
  return {exp_so3(Vec3(0, 0, yaw)) * exp_so3(Vec3(0, pitch, 0)) * exp_so3(Vec3(roll, 0, 0)),
          Vec3(x, y, z)};
}

inline registration::Prediction prediction(const Pose& T, double sigma_m, double sigma_rad) {
  registration::Prediction p;
  p.T_target_vehicle = T;
  p.covariance.setZero();
  p.covariance.diagonal() << Vec3::Constant(sigma_m * sigma_m),
      Vec3::Constant(sigma_rad * sigma_rad);
  return p;
}

}  // namespace rcs::test

#pragma once
// Scans of an imager with 32 rows of 0.625 deg from 20 deg below the horizon on, and columns of
// 0.5 deg, 0.9 m ahead of the origin of a vehicle whose origin is 0.9 m above the ground.

#include <functional>
#include <optional>
#include <random>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::wm {

inline const Vec3 kImager(0.9, 0.0, 0.9);  // vehicle frame

/// Range along a ray from `from` [m]; empty: no return.
using RangeAlong = std::function<std::optional<double>(const Vec3& from, const Vec3& ray)>;

/// @return points in the vehicle frame, with 0.03 m of noise in range
inline Points imager_scan(const Pose& T_local_vehicle, const RangeAlong& range_along,
                          std::mt19937* rng) {
  std::normal_distribution<> noise_m(0.0, 0.03);
  Points points;
  for (int row = 0; row < 32; ++row) {
    const double down = radians(20.0 - 0.625 * row);
    for (int col = -80; col <= 80; ++col) {
      const double left = radians(0.5 * col);
      const Vec3 ray(std::cos(down) * std::cos(left), std::cos(down) * std::sin(left),
                     -std::sin(down));
      const std::optional<double> range_m =
          range_along(T_local_vehicle * kImager, T_local_vehicle.q * ray);
      if (!range_m) continue;
      points.push_back((kImager + (*range_m + noise_m(*rng)) * ray).cast<float>());
    }
  }
  return points;
}

/// Where a ray first satisfies `inside`, in steps of 0.02 m, up to 30 m.
template <typename Inside>
[[nodiscard]] std::optional<double> first_inside(const Vec3& from, const Vec3& ray,
                                                 Inside&& inside) {
  for (double range_m = 1.0; range_m < 30.0; range_m += 0.02) {
    if (inside(from + range_m * ray)) return range_m;
  }
  return std::nullopt;
}

}  // namespace rcs::wm

#pragma once
// Scans of simple scenes by ray casting, in the patterns of several LADARs.

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"

namespace rcs::test {

/// Flat ground at z = 0, and boxes that are aligned with the axes.
struct RayScene {
  struct Box {
    Vec3 low;
    Vec3 high;
  };
  std::vector<Box> boxes;

  /// Distance along the unit vector `d` to the first surface; infinite: none.
  [[nodiscard]] double range_m(const Vec3& from, const Vec3& d) const {
    double nearest = d.z() < 0.0 ? -from.z() / d.z() : std::numeric_limits<double>::infinity();
    for (const Box& box : boxes) {
      double in = 0.0;
      double out = std::numeric_limits<double>::infinity();
      for (int k = 0; k < 3; ++k) {
        const double a = (box.low[k] - from[k]) / d[k];
        const double b = (box.high[k] - from[k]) / d[k];
        in = std::max(in, std::min(a, b));
        out = std::min(out, std::max(a, b));
      }
      if (in < out && in > 0.0) nearest = std::min(nearest, in);
    }
    return nearest;
  }
};

struct ScanPattern {
  std::string name;
  double lowest_deg, highest_deg;  ///< elevation
  int rows;
  double width_deg;  ///< centred ahead
  int cols;
};

inline const std::vector<ScanPattern>& scan_patterns() {
  static const std::vector<ScanPattern> kPatterns = {
      {"16 rings", -15.0, 15.0, 16, 360.0, 900},
      {"32 rings", -30.7, 10.7, 32, 360.0, 720},
      {"64 rings", -24.9, 2.0, 64, 360.0, 1000},
      {"imager 32 x 180", -18.0, 2.0, 32, 80.0, 180},
  };
  return kPatterns;
}

/// In the frame of the sensor, with 2 cm of range noise.
inline Points scan(const RayScene& scene, const ScanPattern& pattern, const Pose& T_scene_sensor,
                   std::mt19937* rng) {
  constexpr double kFarthest_m = 60.0;
  std::normal_distribution<double> noise(0.0, 0.02);
  Points points;
  for (int i = 0; i < pattern.rows; ++i) {
    const double elevation = radians(
        pattern.lowest_deg + (pattern.highest_deg - pattern.lowest_deg) * i / (pattern.rows - 1));
    for (int k = 0; k < pattern.cols; ++k) {
      const double azimuth = radians(pattern.width_deg * ((k + 0.5) / pattern.cols - 0.5));
      const Vec3 d(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                   std::sin(elevation));
      const double range = scene.range_m(T_scene_sensor.p, T_scene_sensor.q * d);
      if (range < kFarthest_m) points.push_back(((range + noise(*rng)) * d).cast<float>());
    }
  }
  return points;
}

/// A flat road between two walls, and things across it: facades that stand back, parked cars,
/// poles.
inline RayScene street(bool with_things_across) {
  RayScene s;
  s.boxes = {{{-100.0, 7.0, 0.0}, {100.0, 9.0, 8.0}}, {{-100.0, -9.0, 0.0}, {100.0, -7.0, 8.0}}};
  if (!with_things_across) return s;
  // Irregular, as streets are: equal distances would repeat themselves.
  for (const double x : {-31.0, -17.5, -6.0, 3.5, 11.0, 24.5, 37.0}) {
    s.boxes.push_back({{x, 5.0, 0.0}, {x + 1.6 + 0.02 * x, 7.0, 5.0}});
    s.boxes.push_back({{x + 4.0, -6.8, 0.0}, {x + 8.2, -5.0, 1.5}});
  }
  for (const double x : {-22.0, -1.5, 7.7, 18.9, 30.3}) {
    s.boxes.push_back({{x, 4.2, 0.0}, {x + 0.2, 4.4, 5.0}});
  }
  return s;
}

}  // namespace rcs::test

#include "sim/terrain/road.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace rcs::sim {
namespace {

double distance_from_segment(const Vec2& a, const Vec2& b, const Vec2& p) {
  const Vec2 line = b - a;
  const double share = std::clamp((p - a).dot(line) / line.squaredNorm(), 0.0, 1.0);
  return (p - (a + share * line)).norm();
}

/// From the surface.
double distance_from(const Road& road, const Vec2& p) {
  double min_m = std::numeric_limits<double>::infinity();
  for (std::size_t k = 1; k < road.points_world.size(); ++k) {
    min_m =
        std::min(min_m, distance_from_segment(road.points_world[k - 1], road.points_world[k], p));
  }
  return min_m - 0.5 * road.width_m;
}

}  // namespace

double distance_from_road(const std::vector<Road>& roads, double x_m, double y_m) {
  double min_m = std::numeric_limits<double>::infinity();
  for (const Road& road : roads) min_m = std::min(min_m, distance_from(road, {x_m, y_m}));
  return min_m;
}

double relief_share(const Road& road, double x_m, double y_m) {
  const double beside = distance_from(road, {x_m, y_m}) / std::max(road.shoulder_m, 1e-3);
  const double s = std::clamp(beside, 0.0, 1.0);
  return s * s * (3.0 - 2.0 * s);
}

}  // namespace rcs::sim

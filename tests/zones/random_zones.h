#pragma once
// Random polygons, and queries of zones by brute force over all of their edges.

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "rcs/zones/zones.h"

namespace rcs::test {

constexpr double kNoBorder = std::numeric_limits<double>::infinity();

/// A ring around a centre, whose radius changes from vertex to vertex: simple, and seldom convex.
inline ZoneRing star(const Vec2& centre, double min_m, double max_m, int vertices,
                     std::mt19937* rng) {
  std::uniform_real_distribution<double> radius(min_m, max_m);
  ZoneRing ring;
  for (int k = 0; k < vertices; ++k) {
    const double angle = 2.0 * kPi * k / vertices;
    ring.push_back(centre + radius(*rng) * Vec2(std::cos(angle), std::sin(angle)));
  }
  if ((*rng)() % 2 == 0) std::reverse(ring.begin(), ring.end());
  return ring;
}

/// Several zones within 100 m of the origin, some with a hole, some with several polygons.
inline std::vector<Zone> random_zones(int count, std::mt19937* rng) {
  std::uniform_real_distribution<double> at(-80.0, 80.0);
  std::vector<Zone> zones;
  for (int k = 0; k < count; ++k) {
    Zone zone;
    zone.kind = k % 3 == 0 ? ZoneKind::kFence : k % 3 == 1 ? ZoneKind::kKeepOut : ZoneKind::kSpeed;
    zone.name = "zone " + std::to_string(k);
    zone.speed_mps = 1.0 + k;
    const int polygons = 1 + static_cast<int>((*rng)() % 2);
    for (int n = 0; n < polygons; ++n) {
      const Vec2 centre(at(*rng), at(*rng));
      const double scale = zone.kind == ZoneKind::kFence ? 3.0 : 1.0;
      ZonePolygon polygon;
      const int vertices = 3 + static_cast<int>((*rng)() % 60);
      polygon.outer = star(centre, 12.0 * scale, 25.0 * scale, std::max(vertices, 6), rng);
      if ((*rng)() % 2 == 0) polygon.holes.push_back(star(centre, 2.0, 5.0, 7, rng));
      zone.polygons.push_back(polygon);
    }
    zones.push_back(zone);
  }
  return zones;
}

inline double distance_to_border(const ZoneRing& ring, const Vec2& p) {
  double least = kNoBorder;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Vec2& a = ring[k];
    const Vec2 along = ring[(k + 1) % ring.size()] - a;
    const double share = std::clamp(along.dot(p - a) / along.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (p - a - share * along).norm());
  }
  return least;
}

/// By the sum of the angles under which the edges are seen.
inline bool inside_ring(const ZoneRing& ring, const Vec2& p) {
  double sum = 0.0;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Vec2 a = ring[k] - p;
    const Vec2 b = ring[(k + 1) % ring.size()] - p;
    sum += std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
  }
  return std::abs(sum) > kPi;
}

/// Positive inside.
inline double depth(const ZonePolygon& polygon, const Vec2& p) {
  double border_m = distance_to_border(polygon.outer, p);
  bool in = inside_ring(polygon.outer, p);
  for (const ZoneRing& hole : polygon.holes) {
    border_m = std::min(border_m, distance_to_border(hole, p));
    in = in && !inside_ring(hole, p);
  }
  return in ? border_m : -border_m;
}

inline double deepest(const std::vector<Zone>& zones, ZoneKind kind, const Vec2& p) {
  double deepest_m = -kNoBorder;
  for (const Zone& zone : zones) {
    for (const ZonePolygon& polygon : zone.polygons) {
      if (zone.kind == kind) deepest_m = std::max(deepest_m, depth(polygon, p));
    }
  }
  return deepest_m;
}

inline double brute_clearance(const std::vector<Zone>& zones, const Vec2& p) {
  const bool fenced = std::any_of(zones.begin(), zones.end(),
                                  [](const Zone& z) { return z.kind == ZoneKind::kFence; });
  const double fence_m = fenced ? deepest(zones, ZoneKind::kFence, p) : kNoBorder;
  return std::min(fence_m, -deepest(zones, ZoneKind::kKeepOut, p));
}

}  // namespace rcs::test

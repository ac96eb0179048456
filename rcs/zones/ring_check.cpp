#include "rcs/zones/ring_check.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "rcs/zones/capsule.h"

namespace rcs {
namespace {

struct Edge {
  Vec2 a, b;
  double min_x, max_x, min_y, max_y;
  std::size_t ring, index, last;  // last: index of the last edge of the ring
};

/// -1, 0 or 1: `p` is on the right of, on, or on the left of the line a-b.
int side(const Vec2& a, const Vec2& b, const Vec2& p) {
  const double doubled_area = cross(b - a, p - a);
  return (doubled_area > 0.0 ? 1 : 0) - (doubled_area < 0.0 ? 1 : 0);
}

/// `p`, which is on the line of the edge, is on the edge.
bool in_box(const Edge& e, const Vec2& p) {
  return p.x() >= e.min_x && p.x() <= e.max_x && p.y() >= e.min_y && p.y() <= e.max_y;
}

bool meet(const Edge& e, const Edge& f) {
  const int e_a = side(e.a, e.b, f.a);
  const int e_b = side(e.a, e.b, f.b);
  const int f_a = side(f.a, f.b, e.a);
  const int f_b = side(f.a, f.b, e.b);
  if (e_a * e_b < 0 && f_a * f_b < 0) return true;
  return (e_a == 0 && in_box(e, f.a)) || (e_b == 0 && in_box(e, f.b)) ||
         (f_a == 0 && in_box(f, e.a)) || (f_b == 0 && in_box(f, e.b));
}

bool follows(const Edge& e, const Edge& next) {
  return e.ring == next.ring &&
         (e.index + 1 == next.index || (e.index == e.last && next.index == 0));
}

/// `next` begins at the end of `e` and leads back along it.
bool leads_back(const Edge& e, const Edge& next) {
  return side(e.a, e.b, next.b) == 0 && (e.b - e.a).dot(next.b - next.a) < 0.0;
}

bool conflict(const Edge& e, const Edge& f) {
  const bool e_first = follows(e, f);
  const bool f_first = follows(f, e);
  if (!e_first && !f_first) return meet(e, f);
  return (e_first && leads_back(e, f)) || (f_first && leads_back(f, e));
}

bool inside(const ZoneRing& ring, const Vec2& p) {
  bool in = false;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const Vec2& a = ring[k];
    const Vec2& b = ring[(k + 1) % ring.size()];
    if ((a.y() <= p.y()) == (b.y() <= p.y())) continue;
    if (side(a, b, p) == (a.y() <= p.y() ? 1 : -1)) in = !in;
  }
  return in;
}

}  // namespace

std::optional<RingFault> find_fault(const ZonePolygon& polygon) {
  std::vector<Edge> edges;
  const auto add = [&](const ZoneRing& ring, std::size_t number) {
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Vec2& a = ring[k];
      const Vec2& b = ring[(k + 1) % ring.size()];
      edges.push_back({a, b, std::min(a.x(), b.x()), std::max(a.x(), b.x()), std::min(a.y(), b.y()),
                       std::max(a.y(), b.y()), number, k, ring.size() - 1});
    }
  };
  add(polygon.outer, 0);
  for (std::size_t h = 0; h < polygon.holes.size(); ++h) add(polygon.holes[h], h + 1);
  std::stable_sort(edges.begin(), edges.end(),
                   [](const Edge& e, const Edge& f) { return e.min_x < f.min_x; });
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const Edge& e = edges[i];
    for (std::size_t j = i + 1; j < edges.size() && edges[j].min_x <= e.max_x; ++j) {
      const Edge& f = edges[j];
      if (f.min_y > e.max_y || f.max_y < e.min_y || !conflict(e, f)) continue;
      return RingFault{RingFault::Kind::kCrossing, e.ring, e.index, f.ring, f.index};
    }
  }
  // The rings do not meet: one vertex of a hole stands for all of it.
  for (std::size_t h = 0; h < polygon.holes.size(); ++h) {
    const Vec2& p = polygon.holes[h].front();
    if (!inside(polygon.outer, p)) return RingFault{RingFault::Kind::kOutside, h + 1, 0, 0, 0};
    for (std::size_t other = 0; other < polygon.holes.size(); ++other) {
      if (other == h || !inside(polygon.holes[other], p)) continue;
      return RingFault{RingFault::Kind::kInOtherHole, h + 1, 0, other + 1, 0};
    }
  }
  return std::nullopt;
}

}  // namespace rcs

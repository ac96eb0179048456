#include "rcs/zones/zones.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rcs/base/check.h"
#include "rcs/zones/capsule.h"

namespace rcs {
namespace {

constexpr std::size_t kChain = 24;  // edges: a query visits all edges of a chain near to it
constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kSame_m = 1e-6;  // smaller lengths are rounding

/// Twice the area; positive: counter-clockwise.
double doubled_area(const ZoneRing& ring) {
  double sum = 0.0;
  for (std::size_t k = 0; k < ring.size(); ++k) {
    // Relative to the first vertex: frame world may be far from the zone.
    sum += cross(ring[k] - ring[0], ring[(k + 1) % ring.size()] - ring[0]);
  }
  return sum;
}

/// How often the ray from `p` towards +x is crossed by the line a-b upwards, less downwards.
int crossings(const Vec2& p, const Vec2& a, const Vec2& b) {
  const bool from_below = a.y() <= p.y();
  const bool to_below = b.y() <= p.y();
  if (from_below == to_below) return 0;
  const bool left_of_it = cross(b - a, p - a) > 0.0;
  if (from_below) return left_of_it ? 1 : 0;
  return left_of_it ? 0 : -1;
}

}  // namespace

Zones::Zones(std::vector<Zone> zones) : zones_(std::move(zones)) {
  for (std::size_t z = 0; z < zones_.size(); ++z) {
    const Zone& zone = zones_[z];
    has_fence_ = has_fence_ || zone.kind == ZoneKind::kFence;
    has_keep_out_ = has_keep_out_ || zone.kind == ZoneKind::kKeepOut;
    for (const ZonePolygon& polygon : zone.polygons) {
      Part part{zone.kind, z, chains_.size(), 0, Box2()};
      add(polygon.outer, true);
      for (const ZoneRing& hole : polygon.holes) add(hole, false);
      part.last_chain = chains_.size();
      for (const Vec2& vertex : polygon.outer) part.box.extend(vertex);
      parts_.push_back(part);
    }
  }
}

void Zones::add(const ZoneRing& ring, bool counter_clockwise) {
  RCS_CHECK(ring.size() >= 3);
  const std::size_t first = vertices_.size();
  vertices_.insert(vertices_.end(), ring.begin(), ring.end());
  if ((doubled_area(ring) > 0.0) != counter_clockwise) {
    std::reverse(vertices_.begin() + static_cast<std::ptrdiff_t>(first), vertices_.end());
  }
  const Vec2 begin = vertices_[first];
  vertices_.push_back(begin);
  for (std::size_t k = first; k + 1 < vertices_.size(); k += kChain) {
    Chain chain{k, std::min(k + kChain, vertices_.size() - 1), Box2()};
    for (std::size_t n = chain.first; n <= chain.last; ++n) chain.box.extend(vertices_[n]);
    chains_.push_back(chain);
  }
}

double Zones::signed_distance(const Part& part, const Vec2& p, double far_m) const {
  double nearest2 = far_m * far_m;
  int winding = 0;
  for (std::size_t c = part.first_chain; c < part.last_chain; ++c) {
    const Chain& chain = chains_[c];
    const Box2& box = chain.box;
    const bool near = box.squaredExteriorDistance(p) < nearest2;
    const bool beside = p.y() >= box.min().y() && p.y() <= box.max().y() && p.x() <= box.max().x();
    if (beside && p.x() < box.min().x()) {
      // All of the chain is on the ray's side: its ends determine the sum of the crossings.
      winding += (vertices_[chain.first].y() <= p.y() ? 1 : 0) -
                 (vertices_[chain.last].y() <= p.y() ? 1 : 0);
    } else if (beside) {
      for (std::size_t k = chain.first; k < chain.last; ++k) {
        winding += crossings(p, vertices_[k], vertices_[k + 1]);
      }
    }
    if (!near) continue;
    for (std::size_t k = chain.first; k < chain.last; ++k) {
      nearest2 = std::min(nearest2, squared_distance(p, vertices_[k], vertices_[k + 1]));
    }
  }
  return winding > 0 ? std::sqrt(nearest2) : -std::sqrt(nearest2);
}

ZoneClearance Zones::clearance(const Vec2& p_world) const {
  ZoneClearance fence{has_fence_ ? -kInfinite : kInfinite, nullptr};
  ZoneClearance keep_out{kInfinite, nullptr};
  for (const Part& part : parts_) {
    if (!rcs::forbids(part.kind)) continue;
    // The largest depth in a polygon of this kind so far; what cannot exceed it is not computed.
    const bool is_fence = part.kind == ZoneKind::kFence;
    const double deepest = is_fence ? fence.m : -keep_out.m;
    const double away_m = part.box.exteriorDistance(p_world);
    if (away_m > 0.0 && deepest >= -away_m) continue;
    const double depth = signed_distance(part, p_world, kInfinite);
    if (depth <= deepest) continue;
    const Zone* const zone = &zones_[part.zone];
    if (is_fence) {
      fence = {depth, zone};
    } else {
      keep_out = {-depth, zone};
    }
  }
  return fence.m < keep_out.m ? fence : keep_out;
}

double Zones::speed_limit_mps(const Vec2& p_world, double margin_m) const {
  double limit_mps = kInfinite;
  for (const Part& part : parts_) {
    const double speed_mps = zones_[part.zone].speed_mps;
    if (part.kind != ZoneKind::kSpeed || speed_mps >= limit_mps) continue;
    if (part.box.exteriorDistance(p_world) > margin_m) continue;
    const bool applies =
        margin_m == kInfinite || signed_distance(part, p_world, margin_m + 1.0) >= -margin_m;
    if (applies) limit_mps = speed_mps;
  }
  return limit_mps;
}

double Zones::road_speed_mps(const Vec2& p_world, double margin_m) const {
  if (margin_m == kInfinite) return 0.0;
  double fastest_mps = 0.0;
  for (const Part& part : parts_) {
    const double speed_mps = zones_[part.zone].speed_mps;
    if (part.kind != ZoneKind::kRoad || speed_mps <= fastest_mps) continue;
    if (!part.box.contains(p_world)) continue;
    if (signed_distance(part, p_world, margin_m + 1.0) >= margin_m) fastest_mps = speed_mps;
  }
  return fastest_mps;
}

const Zone* Zones::conflict(const Vec2& from_world, const Vec2& to_world, double margin_m) const {
  const double radius_m = std::max(margin_m, kSame_m);
  const Vec2 way = to_world - from_world;
  const double length_m = way.norm();
  const Vec2 ahead = length_m > 0.0 ? Vec2(way / length_m) : Vec2(Vec2::UnitX());
  Box2 around(from_world);
  around.extend(to_world);
  const Vec2 wide(radius_m, radius_m);
  around = Box2(around.min() - wide, around.max() + wide);
  for (const Part& part : parts_) {
    if (part.kind != ZoneKind::kKeepOut || !part.box.intersects(around)) continue;
    bool meets = signed_distance(part, from_world, radius_m) > 0.0;
    each_line(part, around, [&](const Vec2& a, const Vec2& b, bool is_edge) {
      if (meets || !is_edge) return;
      const Span span = Capsule(a, b, radius_m).on_line(from_world, ahead);
      meets = !span.empty() && span.first < length_m && span.last > 0.0;
    });
    if (meets) return &zones_[part.zone];
  }
  return has_fence_ ? left_fence(from_world, to_world, radius_m) : nullptr;
}

// From fence to fence: as far as one of them contains the segment, then on in another one.
const Zone* Zones::left_fence(const Vec2& from, const Vec2& to, double margin_m) const {
  const double length_m = (to - from).norm();
  const Vec2 ahead = length_m > 0.0 ? Vec2((to - from) / length_m) : Vec2(Vec2::UnitX());
  double at_m = 0.0;
  for (;;) {
    const Vec2 here = from + at_m * ahead;
    double farthest_m = -1.0;
    const Zone* nearest = nullptr;
    double deepest = -kInfinite;
    for (const Part& part : parts_) {
      if (part.kind != ZoneKind::kFence) continue;
      const double depth = signed_distance(part, here, kInfinite);
      if (depth > deepest || nearest == nullptr) {
        deepest = depth;
        nearest = &zones_[part.zone];
      }
      if (depth < margin_m - kSame_m) continue;
      farthest_m = std::max(farthest_m, way_within(part, from, ahead, at_m, length_m, margin_m));
    }
    if (farthest_m >= length_m) return nullptr;
    if (farthest_m <= at_m + kSame_m) return nearest;
    at_m = farthest_m;
  }
}

double Zones::way_within(const Part& fence, const Vec2& from, const Vec2& ahead, double begin_m,
                         double length_m, double margin_m) const {
  Box2 around(Vec2(from + begin_m * ahead));
  around.extend(Vec2(from + length_m * ahead));
  const Vec2 wide(margin_m, margin_m);
  around = Box2(around.min() - wide, around.max() + wide);
  double end_m = length_m;
  each_line(fence, around, [&](const Vec2& a, const Vec2& b, bool is_edge) {
    if (!is_edge) return;
    const Span span = Capsule(a, b, margin_m).on_line(from, ahead);
    // Where the segment leaves the margin of an edge it has begun within it.
    if (span.empty() || span.last <= begin_m + kSame_m || span.first >= end_m) return;
    end_m = std::max(begin_m, span.first);
  });
  return end_m;
}

}  // namespace rcs

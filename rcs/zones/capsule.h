#pragma once
// The points near a line segment.

#include <algorithm>
#include <cmath>
#include <limits>

#include "rcs/base/linear.h"

namespace rcs {

/// A part of a line; first > last: none.
struct Span {
  double first = std::numeric_limits<double>::infinity();
  double last = -std::numeric_limits<double>::infinity();
  [[nodiscard]] bool empty() const { return first > last; }
};

inline double cross(const Vec2& a, const Vec2& b) { return a.x() * b.y() - a.y() * b.x(); }

/// Square of the distance of a point to a segment.
inline double squared_distance(const Vec2& p, const Vec2& a, const Vec2& b) {
  const Vec2 along = b - a;
  const double length2 = along.squaredNorm();
  const double share = length2 > 0.0 ? std::clamp(along.dot(p - a) / length2, 0.0, 1.0) : 0.0;
  return (p - a - share * along).squaredNorm();
}

/// All points that are not farther from a segment than its radius: a convex set.
class Capsule {
 public:
  Capsule(const Vec2& a, const Vec2& b, double radius)
      : a_(a), b_(b), radius_(radius), length_((b - a).norm()) {
    along_ = length_ > 0.0 ? Vec2((b - a) / length_) : Vec2(Vec2::UnitX());
  }

  /// The part of the line p + t d within the capsule; d is a unit vector.
  [[nodiscard]] Span on_line(const Vec2& p, const Vec2& d) const {
    // The capsule is two discs and a rectangle; the hull of the three parts is the part of all.
    Span out;
    for (const Vec2& centre : {a_, b_}) {
      const Vec2 to = centre - p;
      const double aside = cross(d, to);
      const double half2 = radius_ * radius_ - aside * aside;
      if (half2 < 0.0) continue;
      const double half = std::sqrt(half2);
      out.first = std::min(out.first, to.dot(d) - half);
      out.last = std::max(out.last, to.dot(d) + half);
    }
    Span inside{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    const Vec2 from_a = p - a_;
    clip(along_.dot(from_a), along_.dot(d), 0.0, length_, &inside);
    clip(cross(along_, from_a), cross(along_, d), -radius_, radius_, &inside);
    if (!inside.empty()) {
      out.first = std::min(out.first, inside.first);
      out.last = std::max(out.last, inside.last);
    }
    return out;
  }

 private:
  /// low <= at + t rate <= high
  static void clip(double at, double rate, double low, double high, Span* span) {
    if (std::abs(rate) < 1e-12) {
      if (at < low || at > high) *span = Span{};
      return;
    }
    const double one = (low - at) / rate;
    const double other = (high - at) / rate;
    span->first = std::max(span->first, std::min(one, other));
    span->last = std::min(span->last, std::max(one, other));
  }

  Vec2 a_, b_, along_;
  double radius_;
  double length_;
};

}  // namespace rcs

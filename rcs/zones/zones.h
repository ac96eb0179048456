#pragma once
// Operating zones of the vehicle in the plane of frame world: fences, which it must not leave,
// keep-outs, which it must not enter, zones with a speed limit, and roads, which have no ditches.
// Pure geometry; the queries allocate nothing.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/linear.h"

namespace rcs {

using Box2 = Eigen::AlignedBox2d;

enum class ZoneKind : std::uint8_t { kFence, kKeepOut, kSpeed, kRoad };

[[nodiscard]] inline bool forbids(ZoneKind kind) {
  return kind == ZoneKind::kFence || kind == ZoneKind::kKeepOut;
}

/// At least three vertices; the last one is connected to the first one, which is not repeated.
using ZoneRing = std::vector<Vec2>;

/// A border, and the holes in it. Rings neither cross nor touch one another or themselves.
struct ZonePolygon {
  ZoneRing outer;
  std::vector<ZoneRing> holes;
};

struct Zone {
  ZoneKind kind = ZoneKind::kKeepOut;
  std::string name;
  double speed_mps = 0.0;             ///< of kSpeed and kRoad
  std::vector<ZonePolygon> polygons;  ///< they may overlap
};

/// On which side of its border a fence or a keep-out forbids: for texts that name it.
[[nodiscard]] inline const char* forbidden_side(const Zone& zone) {
  return zone.kind == ZoneKind::kFence ? "outside of fence" : "in keep-out";
}

/// Distance to what is forbidden.
struct ZoneClearance {
  double m = 0.0;              ///< negative: the position is forbidden
  const Zone* zone = nullptr;  ///< to which it is measured; null: there is no fence and no keep-out
};

/// A set of zones with an index. Borders are divided into short chains of edges with a bounding
/// box each, so that a query visits the edges near to it.
class Zones {
 public:
  Zones() = default;
  /// @param zones  vertices in frame world [m], in any orientation
  explicit Zones(std::vector<Zone> zones);

  [[nodiscard]] bool empty() const { return zones_.empty(); }
  [[nodiscard]] const std::vector<Zone>& all() const { return zones_; }
  /// There is a fence or a keep-out.
  [[nodiscard]] bool forbids() const { return has_fence_ || has_keep_out_; }

  /// Distance [m] of a position to the border of the nearest keep-out, or to that of the fence
  /// around it if this is nearer; infinite without both. Inside a keep-out it is the negative
  /// distance to its border, outside of all fences the negative distance to the nearest one. Of
  /// polygons of one kind that overlap, the one in which the position is deepest counts: where
  /// fences overlap, and in overlapping keep-outs, the true distance is the same or larger.
  [[nodiscard]] ZoneClearance clearance(const Vec2& p_world) const;

  /// The zone for which the clearance of some point of a segment is less than a margin >= 0; null:
  /// none.
  [[nodiscard]] const Zone* conflict(const Vec2& from_world, const Vec2& to_world,
                                     double margin_m) const;

  /// Smallest limit of the speed zones within `margin_m` of a position; infinite: none.
  [[nodiscard]] double speed_limit_mps(const Vec2& p_world, double margin_m) const;

  /// Largest speed of the roads in which a position is at least `margin_m` from the border; 0:
  /// none.
  [[nodiscard]] double road_speed_mps(const Vec2& p_world, double margin_m) const;

  /// Edges first to last - 1 of a ring; edge k connects the vertices k and k + 1.
  struct Chain {
    std::size_t first = 0;
    std::size_t last = 0;
    Box2 box;
  };
  /// A polygon of a zone.
  struct Part {
    ZoneKind kind = ZoneKind::kKeepOut;
    std::size_t zone = 0;
    std::size_t first_chain = 0;
    std::size_t last_chain = 0;  ///< one past it
    Box2 box;
  };
  [[nodiscard]] const std::vector<Part>& parts() const { return parts_; }

  /// Calls line(a, b, is_edge) along all rings of a polygon: outer borders counter-clockwise, holes
  /// clockwise. A chain whose box does not meet `around` is one line, which is no edge: it encloses
  /// the same points of `around`.
  template <class Line>
  void each_line(const Part& part, const Box2& around, Line&& line) const {
    for (std::size_t c = part.first_chain; c < part.last_chain; ++c) {
      const Chain& chain = chains_[c];
      if (!around.intersects(chain.box)) {
        line(vertices_[chain.first], vertices_[chain.last], false);
        continue;
      }
      for (std::size_t k = chain.first; k < chain.last; ++k) {
        line(vertices_[k], vertices_[k + 1], true);
      }
    }
  }

 private:
  void add(const ZoneRing& ring, bool counter_clockwise);
  /// Positive inside. If the border is farther than `far_m`, only the sign is exact.
  [[nodiscard]] double signed_distance(const Part& part, const Vec2& p, double far_m) const;
  [[nodiscard]] const Zone* left_fence(const Vec2& from, const Vec2& to, double margin_m) const;
  /// Distance from `from` at which a segment comes nearer to the border of a fence than the margin.
  [[nodiscard]] double way_within(const Part& fence, const Vec2& from, const Vec2& ahead,
                                  double begin_m, double length_m, double margin_m) const;

  std::vector<Zone> zones_;
  std::vector<Vec2> vertices_;  // of each ring, the first one repeated at its end
  std::vector<Chain> chains_;
  std::vector<Part> parts_;
  bool has_fence_ = false;
  bool has_keep_out_ = false;
};

}  // namespace rcs

#pragma once
// The rules of polygons: rings that do not cross or touch, holes inside of their border.

#include <cstddef>
#include <optional>

#include "rcs/zones/zones.h"

namespace rcs {

/// A place where a polygon breaks a rule. Rings: 0 the border, then the holes.
struct RingFault {
  enum class Kind {
    kCrossing,     ///< an edge meets another one, or leads back along the one before
    kOutside,      ///< a hole is not inside of the border
    kInOtherHole,  ///< a hole is inside of another hole
  };
  Kind kind = Kind::kCrossing;
  std::size_t ring = 0;
  std::size_t edge = 0;  ///< of kCrossing: it begins at this vertex
  std::size_t other_ring = 0;
  std::size_t other_edge = 0;
};

/// The first fault of a polygon; none: its rings are simple and disjoint, and its holes inside of
/// the border. Edges are compared in the order of their x: for n edges n log n comparisons if few
/// of them lie above one another, and n^2 / 2 at most.
[[nodiscard]] std::optional<RingFault> find_fault(const ZonePolygon& polygon);

}  // namespace rcs

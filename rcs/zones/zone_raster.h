#pragma once
// The cells of a grid that zones forbid.

#include <cstdint>
#include <vector>

#include "rcs/base/grid.h"
#include "rcs/zones/zones.h"

namespace rcs {

/// A rectangle of cells in a frame that is turned and moved in the plane against frame world.
struct ZoneWindow {
  double cell_m = 0.4;
  Cell first;
  int width = 0;
  int height = 0;
  /// p_window = turn(yaw) p_world + origin
  double yaw_rad = 0.0;
  Vec2 origin_m = Vec2::Zero();
};

/// Computes row by row instead of cell by cell: each edge contributes the interval of a row that is
/// nearer to it than the margin, and its crossing with the row. Allocates nothing for a window that
/// is not larger than those before.
class ZoneRaster {
 public:
  /// Whether Zones::clearance() of the centre of each cell is less than `clearance_m`, which may be
  /// negative; row by row, x fastest.
  const std::vector<std::uint8_t>& forbidden(const Zones& zones, const ZoneWindow& window,
                                             double clearance_m);

 private:
  /// Sets `covered_` where a polygon of this kind has a depth of `depth_m` or more.
  void cover(const Zones& zones, ZoneKind kind, double depth_m);
  void add(const Zones& zones, const Zones::Part& part, const Box2& around, double band_m);
  void add_crossings(const Vec2& a, const Vec2& b);
  void add_band(const Vec2& a, const Vec2& b, double radius);
  template <class Use>
  void each_sum(Use&& use) const;
  [[nodiscard]] Vec2 in_cells(const Vec2& p_world) const;

  ZoneWindow window_;
  double cos_ = 1.0;
  double sin_ = 0.0;
  // Differences along each row: polygons around the cell, and kBand for each edge near to it.
  std::vector<std::int32_t> steps_;
  std::vector<std::uint8_t> covered_;
  std::vector<std::uint8_t> forbidden_;
};

}  // namespace rcs

#pragma once
// What the a priori map says about driving: the cost of a metre and the localizability, in cells of
// some metres.

#include <limits>
#include <vector>

#include "rcs/base/grid.h"
#include "rcs/base/linear.h"
#include "rcs/terrain/elevation_map.h"
#include "rcs/zones/zone_raster.h"
#include "rcs/zones/zones.h"

namespace rcs::mission {

struct RouteMapParams {
  double cell_m = 5.0;          ///< [1, 50]
  double max_slope_rad = 0.35;  ///< steeper cells are impassable
  double ledge_m = 0.6;         ///< a larger step between heights 1 m apart is impassable
  double slope = 2.0;           ///< added to the cost of a metre at the steepest slope
  double unknown = 1.0;         ///< the same where the map has no data
  double match_each_m = 20.0;   ///< distance of the positions whose localizability is computed
  double poor_sigma_m = 5.0;    ///< of a match, worst direction: ground as poor as a plane
};

/// A rectangle of ground in the frame of the map.
struct Area {
  Vec2 low_m = Vec2::Zero();
  Vec2 high_m = Vec2::Zero();
};

class RouteMap {
 public:
  RouteMap() = default;  ///< no map: all ground is unknown, and open
  /// @param map  all of it in memory
  RouteMap(const ElevationMap& map, const Area& area, const RouteMapParams& params);
  /// Open ground without a map around the places of a route.
  RouteMap(const Area& area, const RouteMapParams& params);

  [[nodiscard]] double cell_m() const { return params_.cell_m; }
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] bool contains(Cell c) const {
    return c.i >= 0 && c.j >= 0 && c.i < width_ && c.j < height_;
  }
  [[nodiscard]] Cell cell_at(const Vec2& p_map) const;
  [[nodiscard]] Vec2 centre(Cell c) const;

  /// Of a metre in the cell, at least 1; infinite: impassable, forbidden, or outside.
  [[nodiscard]] float cost(Cell c) const {
    return contains(c) ? cost_[index(c)] * by_zones_[index(c)] : kNever;
  }
  /// Factor of the time that a metre in the cell takes, because of a speed zone: at least 1.
  [[nodiscard]] float slowness(Cell c) const {
    const float factor = contains(c) ? by_zones_[index(c)] : 1.0F;
    return factor < kNever ? factor : 1.0F;
  }
  /// How little a scan matched to the map tells there: 0 as much as anywhere, 1 nothing.
  [[nodiscard]] float poverty(Cell c) const { return contains(c) ? poverty_[index(c)] : 1.0F; }

  /// Cells with less clearance from forbidden ground are impassable, and those in speed zones cost
  /// the time that they take. Replaces the zones set before.
  /// @param zones        in the frame of the map
  /// @param clearance_m  of the centre of a cell; may be negative
  /// @param speed_mps    outside of speed zones
  void set_zones(const Zones& zones, double clearance_m, double speed_mps);

  /// What was found to be impassable, e.g. where BG found no path.
  void block(const Vec2& p_map, double radius_m);
  /// Nothing of that remains.
  void unblock();

  static constexpr float kNever = std::numeric_limits<float>::infinity();

 private:
  [[nodiscard]] std::size_t index(Cell c) const {
    return static_cast<std::size_t>(c.j) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(c.i);
  }
  void size(const Area& area);
  [[nodiscard]] ZoneWindow window(Cell first, Cell last) const;
  [[nodiscard]] float cost_of(const ElevationMap& map, const Vec2& centre) const;

  RouteMapParams params_;
  Vec2 low_m_ = Vec2::Zero();
  int width_ = 0;
  int height_ = 0;
  struct Blocked {
    std::size_t cell;
    float cost;  // without the block
  };
  std::vector<float> cost_;
  std::vector<Blocked> blocked_;
  std::vector<float> poverty_;
  std::vector<float> by_zones_;  // factor of the cost
  ZoneRaster raster_;
};

}  // namespace rcs::mission

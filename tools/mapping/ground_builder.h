#pragma once
// A map of the bare ground from a LADAR's returns, scan by scan.

#include <cstdint>
#include <optional>
#include <vector>

#include "rcs/base/stamp.h"
#include "rcs/terrain/raster.h"
#include "tools/mapping/cell_blocks.h"
#include "tools/mapping/ground_layer.h"
#include "tools/mapping/ground_surface.h"

namespace rcs::mapping {

struct GroundBuilderParams {
  double cell_m = 0.2;          ///< of the map, [0.05, 5]
  double near_sigma_m = 0.02;   ///< of a return's height above the ground, and
  double angle_sigma = 0.0026;  ///< so much more for each metre of range: pitch and roll [rad]
  double neighbour_m = 0.02;    ///< cells differ from the mean of those around them by so much
  Duration look = from_seconds(0.5);  ///< scans so near in time share the error of the pose
};

/// Sigma of a return's height, by the range that it came from [m].
[[nodiscard]] inline double height_sigma(const GroundBuilderParams& p, double range_m) {
  return std::hypot(p.near_sigma_m, p.angle_sigma * range_m);
}

/// What came of the returns.
struct GroundFigures {
  std::int64_t cells = 0;       ///< with a height
  std::int64_t seen_5 = 0;      ///< of them those whose ground 5 scans or more have seen
  std::int64_t ground = 0;      ///< returns of the ground
  std::int64_t standing = 0;    ///< of what stands on it: vegetation, rocks, walls
  std::int64_t moving = 0;      ///< of what was there in few of the looks: it moved
  std::int64_t unplaced = 0;    ///< where no ground was seen
  std::int64_t grown_over = 0;  ///< cells whose lowest returns are of plants
  double roughness_median_m = 0.0;
  double sigma_median_m = 0.0;
};

/// Two passes over the same returns: count() them all, settle(), measure() them all again. Heights
/// are kept as differences to a surface that takes the slope out of the cells. Memory grows by the
/// area that was seen, not by the number of returns.
class GroundBuilder {
 public:
  /// @param surface  finished; outlives the builder
  GroundBuilder(const GroundBuilderParams& params, const GroundSurface* surface)
      : params_(params), surface_(surface) {}

  /// @param p  in the map's frame; @param range_m  from the LADAR
  void count(const Vec3& p, double range_m);
  /// Decides in each cell, with the eight around it, which height is the ground's.
  void settle();
  /// @param stamp  of the scan, @param scan  its number
  void measure(const Vec3& p, double range_m, Stamp stamp, std::uint32_t scan);
  /// After the last return.
  void finish();

  [[nodiscard]] const GroundFigures& figures() const { return figures_; }
  [[nodiscard]] std::size_t bytes() const;
  /// After finish(): what stood there at times went away.
  [[nodiscard]] bool passing(double x_m, double y_m) const;
  /// The map's tiles that hold a height, by j, then i.
  [[nodiscard]] std::vector<Cell> tiles() const;
  /// One of them. Heights above the map's tangent plane; count: scans that saw the ground.
  /// @param level  of cells of the size of the builder's, its origin 0
  [[nodiscard]] Raster tile(const MapLevel& level, Cell tile, std::uint16_t date) const;

 private:
  /// Of one look, and of all looks before it; heights are above the surface.
  struct Place {
    bool known = false;
    GroundLayer layer;
    double pool_m = 0.0;     // ground of the cells around, likewise
    int pool_returns = 1;    // in them
    std::int64_t look = -1;  // under way
    float look_w = 0.0F;     // sums of it: 1 / sigma^2
    float look_wz = 0.0F;
    bool look_above = false;
    bool look_counts = false;
    // Sums over looks of w, w z, w^2, w^2 z and w^2 z^2.
    double w = 0.0, wz = 0.0, ww = 0.0, wwz = 0.0, wwzz = 0.0;
    std::uint32_t scan = 0;  // the latest that saw the ground
    std::uint16_t scans = 0;
    std::uint16_t looks = 0;
    std::uint16_t looks_ground = 0;
    std::uint16_t looks_above = 0;
    std::uint32_t above = 0;  // returns
    float z_m = 0.0F;         // results
    float sigma_m = 0.0F;
    float roughness_m = 0.0F;
  };
  [[nodiscard]] static bool passing(const Place& place);
  [[nodiscard]] Cell cell_at(const Vec3& p) const;
  [[nodiscard]] Vec2 centre(Cell c) const;
  void refuse_grown_over();
  void end_look(Place* place) const;
  void find_heights();
  void find_sigmas();

  GroundBuilderParams params_;
  const GroundSurface* surface_;
  CellBlocks<HeightCounts> counts_;
  CellBlocks<Place> places_;
  double bare_sigma_m_ = 0.0;  // of returns of bare ground, about its height
  GroundFigures figures_;
};

}  // namespace rcs::mapping

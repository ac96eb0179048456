#pragma once
// Builds a map of the bare ground from LADAR returns, scan by scan.

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
  double cell_m = 0.2;                ///< of the map, [0.05, 5]
  double near_sigma_m = 0.02;         ///< sigma of the height of a return
  double angle_sigma = 0.0026;        ///< increase per metre of range, from pitch and roll [rad]
  double neighbour_m = 0.02;          ///< deviation of a cell from the mean of its neighbours
  Duration look = from_seconds(0.5);  ///< scans within this time share the error of the pose
};

/// Sigma of the height of a return as a function of range [m].
[[nodiscard]] inline double height_sigma(const GroundBuilderParams& p, double range_m) {
  return std::hypot(p.near_sigma_m, p.angle_sigma * range_m);
}

/// Statistics of the map and of the returns.
struct GroundMetrics {
  std::int64_t cells = 0;           ///< with a height
  std::int64_t observed_5 = 0;      ///< of them those with ground observed by 5 scans or more
  std::int64_t ground = 0;          ///< returns of the ground
  std::int64_t above_ground = 0;    ///< of above-ground structure: vegetation, rocks, walls
  std::int64_t transient = 0;       ///< of transient objects, present in few observations
  std::int64_t without_ground = 0;  ///< where no ground was observed
  std::int64_t vegetated = 0;       ///< vegetated cells, whose lowest returns are of plants
  double roughness_median_m = 0.0;
  double sigma_median_m = 0.0;
};

/// Two passes over the same returns: count() all, settle(), measure() all again. Heights are stored
/// relative to a surface, which removes the slope of the cells. Memory is proportional to the
/// observed area, not to the number of returns.
class GroundBuilder {
 public:
  /// @param surface  finished; must outlive the builder
  GroundBuilder(const GroundBuilderParams& params, const GroundSurface* surface)
      : params_(params), surface_(surface) {}

  /// @param p  in the frame of the map; @param range_m  from the LADAR
  void count(const Vec3& p, double range_m);
  /// Estimates the height of the ground in each cell, using its eight neighbours.
  void settle();
  /// @param stamp  of the scan, @param scan  its number
  void measure(const Vec3& p, double range_m, Stamp stamp, std::uint32_t scan);
  /// Call it after the last return.
  void finish();

  [[nodiscard]] const GroundMetrics& metrics() const { return metrics_; }
  [[nodiscard]] std::size_t bytes() const;
  /// After finish(): true if the above-ground structure there is transient.
  [[nodiscard]] bool transient(double x_m, double y_m) const;
  /// The tiles of the map with known heights, by j, then i.
  [[nodiscard]] std::vector<Cell> tiles() const;
  /// One tile. Heights above the tangent plane of the map; count: scans that observed the ground.
  /// @param level  with the cell size of the builder, origin 0
  [[nodiscard]] Raster tile(const MapLevel& level, Cell tile, std::uint16_t date) const;

 private:
  /// Sums of the current observation and of all previous ones; heights are above the surface.
  struct CellStatistics {
    bool known = false;
    GroundLayer layer;
    double pool_m = 0.0;     // ground of the neighbouring cells
    int pool_returns = 1;    // in them
    std::int64_t look = -1;  // the current observation
    float look_w = 0.0F;     // its sums: 1 / sigma^2
    float look_wz = 0.0F;
    bool look_above = false;
    bool look_counts = false;
    // Sums over observations of w, w z, w^2, w^2 z and w^2 z^2.
    double w = 0.0, wz = 0.0, ww = 0.0, wwz = 0.0, wwzz = 0.0;
    std::uint32_t scan = 0;  // the latest that observed the ground
    std::uint16_t scans = 0;
    std::uint16_t looks = 0;
    std::uint16_t looks_ground = 0;
    std::uint16_t looks_above = 0;
    std::uint32_t above = 0;  // returns
    float z_m = 0.0F;         // results
    float sigma_m = 0.0F;
    float roughness_m = 0.0F;
  };
  [[nodiscard]] static bool transient(const CellStatistics& place);
  [[nodiscard]] Cell cell_at(const Vec3& p) const;
  [[nodiscard]] Vec2 centre(Cell c) const;
  void refuse_grown_over();
  void end_observation(CellStatistics* place) const;
  void find_heights();
  void find_sigmas();

  GroundBuilderParams params_;
  const GroundSurface* surface_;
  CellBlocks<HeightCounts> counts_;
  CellBlocks<CellStatistics> places_;
  double bare_sigma_m_ = 0.0;  // of returns of bare ground, about its height
  GroundMetrics metrics_;
};

}  // namespace rcs::mapping

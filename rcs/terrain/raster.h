#pragma once
// Ground heights on a lattice of cells: the form in which maps are made, imported and merged.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rcs/base/grid.h"
#include "rcs/base/linear.h"
#include "rcs/base/result.h"
#include "rcs/terrain/surface_points.h"

namespace rcs {

/// Origin of the height of a cell.
enum class CellSource : std::uint8_t {
  kUnknown,
  kSurvey,  ///< on the ground
  kAerial,  ///< from aircraft or space
  kSensed,  ///< by a vehicle's own LADAR
  kMixed    ///< several of them
};
constexpr int kCellSources = 5;

/// A lattice of cells in a map's frame; cell (i, j) covers origin + [i, i+1) x [j, j+1) * cell_m.
struct MapLevel {
  double cell_m = 1.0;              ///< [0.01, 10000]
  Vec2 origin_m = Vec2::Zero();     ///< within 1000 km of the map's datum
  double bias_sigma_m = 0.0;        ///< systematic error of the survey, [0, 1000]
  double bias_correlation_m = 1e3;  ///< of it: first-order Gauss-Markov in distance, (0, 1e7]

  [[nodiscard]] Cell cell_at(double x_m, double y_m) const {
    return {cell_index((x_m - origin_m.x()) / cell_m), cell_index((y_m - origin_m.y()) / cell_m)};
  }
  [[nodiscard]] Vec2 centre(Cell c) const { return origin_m + cell_m * Vec2(c.i + 0.5, c.j + 0.5); }
  friend bool operator==(const MapLevel& a, const MapLevel& b) {
    return a.cell_m == b.cell_m && a.origin_m == b.origin_m && a.bias_sigma_m == b.bias_sigma_m &&
           a.bias_correlation_m == b.bias_correlation_m;
  }
};

/// A rectangle of a level's cells. A layer other than the heights has a value for every cell, or
/// one value for all cells.
struct Raster {
  MapLevel level;
  Cell first;      ///< the south-western cell
  int width = 0;   ///< cells along x
  int height = 0;  ///< cells along y
  /// Of the ground at the cell's centre, above the tangent plane at the map's datum, x fastest;
  /// NaN: unknown.
  std::vector<float> z_m;
  /// Standard deviation of (ground - interpolated height) at a point, without the systematic error.
  std::vector<float> sigma_m = {1.0F};
  std::vector<std::uint16_t> count = {0};  ///< of averaged measurements; 65535: or more
  std::vector<std::uint16_t> date = {0};   ///< newest, days since 2000-01-01; 0: unknown
  std::vector<CellSource> source = {CellSource::kUnknown};
  std::vector<SurfacePoint> points;  ///< of above-ground structure, where known

  [[nodiscard]] std::size_t cells() const {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  }
  /// Index of a cell of the lattice that lies in the rectangle.
  [[nodiscard]] std::size_t at(Cell c) const {
    return static_cast<std::size_t>(c.j - first.j) * static_cast<std::size_t>(width) +
           static_cast<std::size_t>(c.i - first.i);
  }
  [[nodiscard]] bool contains(Cell c) const {
    return c.i >= first.i && c.j >= first.j && c.i - first.i < width && c.j - first.j < height;
  }
};

/// A layer's value at a cell.
template <class T>
[[nodiscard]] const T& layer_at(const std::vector<T>& layer, std::size_t cell) {
  return layer[layer.size() == 1 ? 0 : cell];
}

/// An error if a level is invalid (units, non-finite numbers).
[[nodiscard]] Outcome check_level(const MapLevel& level);

/// An error if a raster is invalid.
[[nodiscard]] Outcome check_raster(const Raster& raster);

/// The cells and points of `raster` in a rectangle; cells that it does not cover are unknown.
[[nodiscard]] Raster cut(const Raster& raster, Cell first, int width, int height);

}  // namespace rcs

#pragma once
// The a priori map: elevation tiles as one surface with its uncertainty.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/grid.h"
#include "rcs/base/linear.h"
#include "rcs/base/result.h"
#include "rcs/terrain/elevation_tile.h"

namespace rcs {

/// The ground at one place.
struct Elevation {
  double z_m = 0.0;              ///< above the datum's tangent plane: z in frame world
  Vec2 gradient = Vec2::Zero();  ///< (dz/dx, dz/dy)
  double sigma_m = 0.0;          ///< of z_m, without the slow bias (see bias_sigma_m())
  std::int64_t tile_id = 0;      ///< of the tile that holds the nearest cell
};

/// Bilinear interpolation on the lattice of cell centres, across the borders of tiles. Loading is
/// for preparation time; sampling allocates nothing and may be called from anywhere.
class ElevationMap {
 public:
  /// A tile file, or a directory of files *.tile (taken in the order of their names).
  [[nodiscard]] static Result<ElevationMap> load(const std::string& path);

  /// All tiles must share datum, cell_m and bias figures and lie on one lattice; where they
  /// overlap, the later tile's known cells win.
  [[nodiscard]] static Result<ElevationMap> from_tiles(const std::vector<ElevationTile>& tiles);

  [[nodiscard]] const Geodetic& datum() const { return datum_; }
  [[nodiscard]] double bias_sigma_m() const { return bias_sigma_m_; }
  [[nodiscard]] double bias_correlation_m() const { return bias_correlation_m_; }
  [[nodiscard]] double cell_m() const { return cell_m_; }

  /// @param x_m, y_m  frame world
  /// @return false, and `out` untouched, outside or where one of the four cells is unknown
  [[nodiscard]] bool sample(double x_m, double y_m, Elevation* out) const;

  /// Index of the cell that holds a place; defined everywhere, also outside the map.
  [[nodiscard]] Cell cell_at(double x_m, double y_m) const;

 private:
  struct Node {
    float z_m;      ///< NaN: unknown
    float sigma_m;  ///< > 0 where known
    int tile;       ///< index into tile_ids_
  };

  ElevationMap() = default;
  [[nodiscard]] Outcome paste(const ElevationTile& tile, int index);

  Geodetic datum_;
  double bias_sigma_m_ = 0.0;
  double bias_correlation_m_ = 0.0;
  double cell_m_ = 1.0;
  Vec2 origin_world_m_ = Vec2::Zero();  ///< the south-western corner of node (0, 0)'s cell
  int width_ = 0;
  int height_ = 0;
  std::vector<Node> nodes_;  ///< x fastest
  std::vector<std::int64_t> tile_ids_;
};

}  // namespace rcs

#pragma once
// Resamples the ground of a map to the lattice of another, for comparison and merging.

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/raster.h"

namespace rcs::mapping {

/// The ground of a raster at the centres of other cells, above another frame's tangent plane, by
/// bilinear interpolation. The verticals differ: the intersection of the vertical of a centre with
/// the surface is found by iteration. Cells that need an unknown node are unknown. Sigma is
/// interpolated, too; on a coarser lattice it is at least the interpolation error between the nodes
/// of that lattice. Count, date and source are from the nearest cell.
/// @param T_from_to  from the frame of the result to that of `from`; tilted by less than 30 deg
/// @param to  the lattice of the result; its bias is that of `from`
/// @param first, width, height  the cells of the result [cells of `to`]
[[nodiscard]] Raster resample(const Raster& from, const Pose& T_from_to, const MapLevel& to,
                              Cell first, int width, int height);

/// A map on disk, resampled to the lattice of another map. Keeps the tiles of one request.
class MapResampler {
 public:
  /// Uses the coarsest level whose cells are not larger than those requested (else its finest): a
  /// much finer one would not represent the ground between the nodes of the lattice.
  /// @param like  map that defines the frame of the cells; another reference frame, other heights
  ///   or a datum more than 1000 km away is an error that names both
  /// @param cell_m  of the cells to be requested
  [[nodiscard]] static Result<MapResampler> open(const std::string& path, const MapFolder& like,
                                                 double cell_m);

  [[nodiscard]] const MapFolder& map() const { return map_; }
  [[nodiscard]] const MapLevel& level() const { return tiles().level; }  ///< the level that is read

  /// The tiles of a lattice that may overlap the tiles of the map: for each one a pair (low, high)
  /// of indices, both inclusive.
  [[nodiscard]] std::vector<std::pair<Cell, Cell>> reaches(const MapLevel& to) const;

  /// See resample(). Cells outside the map are unknown; a tile that can't be read is an error.
  [[nodiscard]] Result<Raster> read(const MapLevel& to, Cell first, int width, int height);

 private:
  MapResampler(MapFolder map, std::size_t level, const Pose& T_map_like);
  [[nodiscard]] const MapLevelIndex& tiles() const { return map_.index().levels[level_]; }
  [[nodiscard]] Outcome bring(Cell low_tile, Cell high_tile);

  MapFolder map_;
  std::size_t level_;
  Pose T_map_like_;
  float low_m_ = std::numeric_limits<float>::max();  // of its heights
  float high_m_ = std::numeric_limits<float>::lowest();
  Raster window_;  // the tiles of the last request
  std::vector<std::uint8_t> buffer_;
};

}  // namespace rcs::mapping

#pragma once
// A map's ground on another map's lattice: what maps are compared and merged by.

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
/// bilinear interpolation. Its vertical is tilted against the raster's: where a centre's plumb line
/// meets the surface is found by iteration. Cells that need a node which is not known are unknown.
/// Sigma is interpolated, too; on a coarser lattice it is at least what interpolation between that
/// lattice's nodes misses of the surface. Count, date and source are the nearest cell's.
/// @param T_from_to  from the frame of the result to that of `from`; tilted by less than 30 deg
/// @param to  the lattice of the result; its bias is that of `from`
/// @param first, width, height  the cells of the result [cells of `to`]
[[nodiscard]] Raster resample(const Raster& from, const Pose& T_from_to, const MapLevel& to,
                              Cell first, int width, int height);

/// A map on disk, asked for cells of another map's lattice. Holds what one question needs.
class MapResampler {
 public:
  /// Takes the coarsest level whose cells are not larger than those asked for (else its finest):
  /// one that is finer than the lattice by far would say nothing of the ground between its nodes.
  /// @param like  whose frame the cells are in; one of another reference frame, of other heights
  ///   or with a datum more than 1000 km off is an error that names both
  /// @param cell_m  of the cells that will be asked for
  [[nodiscard]] static Result<MapResampler> open(const std::string& path, const MapFolder& like,
                                                 double cell_m);

  [[nodiscard]] const MapFolder& map() const { return map_; }
  [[nodiscard]] const MapLevel& level() const { return tiles().level; }  ///< that is read

  /// Which tiles of a lattice the map's own may reach into: pairs (low, high) of their numbers,
  /// both within, one for each of its own.
  [[nodiscard]] std::vector<std::pair<Cell, Cell>> reaches(const MapLevel& to) const;

  /// See resample(). What the map does not cover is unknown; a tile that can't be read is an error.
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
  Raster window_;  // the tiles that were asked for last
  std::vector<std::uint8_t> buffer_;
};

}  // namespace rcs::mapping

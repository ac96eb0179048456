#pragma once
// A map on disk: a folder with `map.index` and, by level, a file for each tile.

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"

namespace rcs {

/// Path of a map's index.
[[nodiscard]] std::string index_file(const std::string& map);

/// Path of a tile of a map.
[[nodiscard]] std::string tile_file(const std::string& map, double cell_m, Cell tile);

/// Reads a file into a reused buffer.
[[nodiscard]] Outcome read_file(const std::string& path, std::size_t most,
                                std::vector<std::uint8_t>* bytes);

/// Reads a tile with all of its layers.
/// @param lattice  lattice_id() of the tile's map and level
/// @param buffer  reused from call to call
[[nodiscard]] Result<Raster> read_tile(const std::string& file, Cell tile, std::uint64_t lattice,
                                       std::vector<std::uint8_t>* buffer);

class MapFolder {
 public:
  /// Reads the index alone: 24 to 28 bytes a tile, independently of the map's area otherwise.
  [[nodiscard]] static Result<MapFolder> open(const std::string& path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const MapIndex& index() const { return index_; }
  [[nodiscard]] std::string file_of(int level, Cell tile) const;

  /// Reads a whole tile with all of its layers.
  /// @param buffer  reused from call to call
  /// @return an error also if the file is not that of the index, by its checksum
  [[nodiscard]] Result<Raster> read(int level, Cell tile, std::vector<std::uint8_t>* buffer) const;

 private:
  MapFolder(std::string path, MapIndex index);

  std::string path_;
  MapIndex index_;
  std::vector<std::uint64_t> lattices_;  // of the levels
};

}  // namespace rcs

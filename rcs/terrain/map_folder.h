#pragma once
// A map on disk: a folder with `map.index` and, by level, a file for each tile.

#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"

namespace rcs {

/// Where a map keeps a tile.
[[nodiscard]] std::string tile_file(const std::string& map, double cell_m, Cell tile);

/// A file's bytes, in a buffer that is reused.
[[nodiscard]] Outcome read_file(const std::string& path, std::size_t most,
                                std::vector<std::uint8_t>* bytes);

class MapFolder {
 public:
  /// Reads the index alone: the time does not depend on the map's area but by 24 bytes a tile.
  [[nodiscard]] static Result<MapFolder> open(const std::string& path);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] const MapIndex& index() const { return index_; }
  [[nodiscard]] std::string file_of(int level, Cell tile) const;

  /// A whole tile with all of its layers.
  /// @param buffer  reused from call to call
  [[nodiscard]] Result<Raster> read(int level, Cell tile, std::vector<std::uint8_t>* buffer) const;

 private:
  friend class MapWriter;
  MapFolder(std::string path, MapIndex index);

  std::string path_;
  MapIndex index_;
  std::vector<std::uint64_t> lattices_;  // of the levels
};

/// Writes a map: appears under its name when it is complete, and not before. Tiles may come in any
/// order.
class MapWriter {
 public:
  MapWriter(MapWriter&& other) noexcept;
  MapWriter& operator=(MapWriter&&) = delete;
  ~MapWriter();  ///< what was not finished is removed

  /// @param levels  finest first
  /// @param path  a map that is there is replaced as a whole; anything else, and a map's folder
  ///     with other files in it, is an error
  [[nodiscard]] static Result<MapWriter> create(const std::string& path, const MapFrame& frame,
                                                const std::vector<MapLevel>& levels);

  /// Cuts a raster along the tiles' borders. Cells of a tile that came before stay where the raster
  /// knows nothing. A tile without a known cell is not written.
  [[nodiscard]] Outcome put(int level, const Raster& raster);

  /// Coarser levels from the one before, by four cells each way, as long as they have fewer tiles.
  [[nodiscard]] Outcome add_coarser_levels();

  [[nodiscard]] Outcome finish();

 private:
  MapWriter(MapFolder part, std::string path);
  [[nodiscard]] Outcome put_tile(int level, Raster tile);
  [[nodiscard]] Outcome add_coarser_level(bool* fewer);

  MapFolder part_;  // under the name of what is not complete
  std::string path_;
  std::vector<std::uint8_t> buffer_;
};

/// A map of one level with what is coarser.
[[nodiscard]] Outcome write_map(const std::string& path, const MapFrame& frame,
                                const Raster& raster);

}  // namespace rcs

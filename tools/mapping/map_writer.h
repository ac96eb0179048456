#pragma once
// Writes a map on disk (see rcs/terrain/map_folder.h).

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"

namespace rcs::mapping {

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
  MapWriter(std::string part, MapIndex index, std::string path);
  [[nodiscard]] std::string file_of(int level, Cell tile) const;
  [[nodiscard]] Outcome put_tile(int level, Raster tile);
  [[nodiscard]] Outcome add_coarser_level(bool* fewer);

  std::string part_;  // the folder that is renamed when it is complete
  MapIndex index_;
  std::vector<std::uint64_t> lattices_;  // of the levels
  std::string path_;                     // empty: finished, or moved from
  std::vector<std::uint8_t> buffer_;
};

/// A map of one level with what is coarser.
[[nodiscard]] Outcome write_map(const std::string& path, const MapFrame& frame,
                                const Raster& raster);

}  // namespace rcs::mapping

#pragma once
// Writes a map to disk (see rcs/terrain/map_folder.h).

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"

namespace rcs::mapping {

/// Writes a map, which gets its name only when it is complete. Tiles may be added in any order.
class MapWriter {
 public:
  MapWriter(MapWriter&& other) noexcept;
  MapWriter& operator=(MapWriter&&) = delete;
  ~MapWriter();  ///< removes an unfinished map

  /// @param levels  finest first
  /// @param path  an existing map is replaced as a whole; anything else, and the folder of a map
  ///     with other files in it, is an error
  [[nodiscard]] static Result<MapWriter> create(const std::string& path, const MapFrame& frame,
                                                const std::vector<MapLevel>& levels);

  /// Cuts a raster along the borders of tiles. Cells of an earlier tile are kept where the raster
  /// is unknown. A tile without a known cell is not written.
  [[nodiscard]] Outcome put(int level, const Raster& raster);

  /// Adds coarser levels, by four cells along each axis, as long as they have fewer tiles.
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

/// Writes a map of one level with its coarser levels.
[[nodiscard]] Outcome write_map(const std::string& path, const MapFrame& frame,
                                const Raster& raster);

}  // namespace rcs::mapping

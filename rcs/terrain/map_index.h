#pragma once
// The georeference of a map and the list of its tiles: the file `map.index` of its folder.

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/result.h"
#include "rcs/terrain/raster.h"

namespace rcs {

/// Georeference of a map. Its axes are east, north and up at the datum.
struct MapFrame {
  Geodetic datum;
  /// The geodetic reference frame of the datum, in which the GPS fixes must be, too: "WGS84",
  /// "ETRS89", "NAD83(2011)", as EPSG calls it. Frames differ by up to two metres.
  std::string reference = "WGS84";
  /// Reference surface of the heights: "ellipsoid"; the geoid or vertical datum ("EGM96") if the
  /// undulation was unknown and they could not be converted; the name of the reference frame if
  /// that is a site's own, including its heights.
  std::string heights = "ellipsoid";
  std::string source_crs;  ///< of what the map was imported from, for people
  /// Geoid above the ellipsoid at the datum [m], with which heights were converted; NaN: they were
  /// imported as ellipsoidal heights.
  double undulation_m = std::numeric_limits<double>::quiet_NaN();
};

/// Error if a vehicle whose fixes are in `reference`, with heights above the ellipsoid, cannot use
/// the map.
[[nodiscard]] Outcome check_frame(const MapFrame& map, const std::string& reference);

/// Identifier of a tile's lattice: equal for equal datum, reference frame, heights, cell and
/// origin, in any map.
[[nodiscard]] std::uint64_t lattice_id(const MapFrame& frame, const MapLevel& level);

struct MapTileEntry {
  Cell tile;
  std::uint32_t checksum = 0;  ///< of the file
  std::uint32_t known = 0;     ///< cells with a height
  float low_m = 0.0F;          ///< the lowest of them
  float high_m = 0.0F;
  std::uint32_t points = 0;  ///< surface points of above-ground structure
};

struct MapLevelIndex {
  MapLevel level;
  std::vector<MapTileEntry> tiles;  ///< by j, then i
  [[nodiscard]] const MapTileEntry* find(Cell tile) const;
  void enter(const MapTileEntry& entry);  ///< replaces an entry of the same tile
};

struct MapIndex {
  MapFrame frame;
  std::vector<MapLevelIndex> levels;  ///< finest cell first
};

[[nodiscard]] Outcome check_index(const MapIndex& index);
[[nodiscard]] std::vector<std::uint8_t> encode_index(const MapIndex& index);
[[nodiscard]] Result<MapIndex> decode_index(const std::vector<std::uint8_t>& bytes);

/// Identifier of a tile in messages and reports: level, i and j in one number.
[[nodiscard]] constexpr std::int64_t tile_id(int level, Cell tile) {
  return (static_cast<std::int64_t>(level) << 56) +
         (static_cast<std::int64_t>(tile.i & 0xFFFFFFF) << 28) +
         static_cast<std::int64_t>(tile.j & 0xFFFFFFF);
}

}  // namespace rcs

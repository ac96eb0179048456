#pragma once
// What a map is, and which tiles it has: the file `map.index` of its folder.

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/result.h"
#include "rcs/terrain/raster.h"

namespace rcs {

/// How a map lies on the earth. Its axes are east, north and up at the datum.
struct MapFrame {
  Geodetic datum;
  /// The geodetic reference frame of the datum, in which a receiver's fixes must be, too: "WGS84",
  /// "ETRS89", "NAD83(2011)", as EPSG calls it. Frames differ by up to two metres.
  std::string reference = "WGS84";
  /// What heights are above: "ellipsoid"; the geoid or vertical datum ("EGM96") where the
  /// undulation was not known and they could not be converted; the reference frame's name where
  /// that is a site's own, heights and all.
  std::string heights = "ellipsoid";
  std::string source_crs;  ///< of what the map was imported from, for people
  /// Geoid above the ellipsoid at the datum [m], by which heights were converted; NaN: they came as
  /// ellipsoidal ones.
  double undulation_m = std::numeric_limits<double>::quiet_NaN();
};

/// Why a vehicle whose fixes are in `reference`, with heights above the ellipsoid, can't use a map.
[[nodiscard]] Outcome check_frame(const MapFrame& map, const std::string& reference);

/// Which lattice a tile is a part of: equal for equal datum, reference frame, heights, cell and
/// origin, whatever map it is in.
[[nodiscard]] std::uint64_t lattice_id(const MapFrame& frame, const MapLevel& level);

struct MapTileEntry {
  Cell tile;
  std::uint32_t checksum = 0;  ///< of the file
  std::uint32_t known = 0;     ///< cells with a height
  float low_m = 0.0F;          ///< the lowest of them
  float high_m = 0.0F;
  std::uint32_t points = 0;  ///< of what stands on the ground
};

struct MapLevelIndex {
  MapLevel level;
  std::vector<MapTileEntry> tiles;  ///< by j, then i
  [[nodiscard]] const MapTileEntry* find(Cell tile) const;
  void enter(const MapTileEntry& entry);  ///< instead of the tile's former one, if it has one
};

struct MapIndex {
  MapFrame frame;
  std::vector<MapLevelIndex> levels;  ///< finest cell first
};

[[nodiscard]] Outcome check_index(const MapIndex& index);
[[nodiscard]] std::vector<std::uint8_t> encode_index(const MapIndex& index);
[[nodiscard]] Result<MapIndex> decode_index(const std::vector<std::uint8_t>& bytes);

/// A tile's name in messages and reports: level, i and j in one number.
[[nodiscard]] constexpr std::int64_t tile_id(int level, Cell tile) {
  return (static_cast<std::int64_t>(level) << 56) +
         (static_cast<std::int64_t>(tile.i & 0xFFFFFFF) << 28) +
         static_cast<std::int64_t>(tile.j & 0xFFFFFFF);
}

}  // namespace rcs

#include "rcs/terrain/map_index.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "rcs/base/byte_codec.h"
#include "rcs/base/check.h"
#include "rcs/terrain/map_tile.h"

namespace rcs {
namespace {

constexpr char kIndexMagic[] = "RCSMAPS\n";
constexpr std::size_t kIndexMagicSize = 8;
constexpr std::uint32_t kIndexVersion = 1;
constexpr std::uint32_t kIndexVersionWithPoints = 2;  // with the number of points of each tile
constexpr std::size_t kIndexHeaderSize = 16;          // magic, version, checksum of the rest
constexpr std::size_t kEntrySize = 24;                // of version 1
constexpr std::size_t kIndexCountSize = 4;
constexpr std::size_t kMaxLevels = 16;
constexpr std::size_t kMaxText = 1024;

bool before(Cell a, Cell b) { return a.j != b.j ? a.j < b.j : a.i < b.i; }

/// Position of `tile` among `tiles`, or where it belongs.
template <class Tiles>
auto place_of(Cell tile, Tiles* tiles) {
  return std::lower_bound(
      tiles->begin(), tiles->end(), tile,
      [](const MapTileEntry& e, Cell wanted) { return before(e.tile, wanted); });
}

bool with_points(const MapIndex& index) {
  for (const MapLevelIndex& level : index.levels) {
    for (const MapTileEntry& e : level.tiles) {
      if (e.points > 0) return true;
    }
  }
  return false;
}

void put_datum(const Geodetic& datum, wire::Writer* w) {
  w->put(datum.lat_rad);
  w->put(datum.lon_rad);
  w->put(datum.height.m);
}

/// The lattice of a level's cells.
void put_cells(const MapLevel& level, wire::Writer* w) {
  w->put(level.cell_m);
  w->put(level.origin_m.x());
  w->put(level.origin_m.y());
}

}  // namespace

Outcome check_frame(const MapFrame& map, const std::string& reference) {
  if (map.reference != reference) {
    return Error{"the map is in reference frame " + map.reference + ", the GPS fixes are in " +
                 reference};
  }
  // A local frame, such as a city's or a site's, may have its own heights.
  if (map.heights != "ellipsoid" && map.heights != map.reference) {
    return Error{"the heights of the map are above " + map.heights +
                 ", those of the vehicle above the ellipsoid of " + reference +
                 ": import it again with the undulation"};
  }
  return Done{};
}

std::uint64_t lattice_id(const MapFrame& frame, const MapLevel& level) {
  wire::Writer w;
  put_datum(frame.datum, &w);
  w.put(frame.reference);
  w.put(frame.heights);
  put_cells(level, &w);
  std::uint64_t hash = 14695981039346656037ULL;  // FNV-1a
  for (const std::uint8_t byte : w.bytes) hash = (hash ^ byte) * 1099511628211ULL;
  return hash;
}

const MapTileEntry* MapLevelIndex::find(Cell tile) const {
  const auto at = place_of(tile, &tiles);
  return at != tiles.end() && at->tile == tile ? &*at : nullptr;
}

void MapLevelIndex::enter(const MapTileEntry& entry) {
  const auto at = place_of(entry.tile, &tiles);
  if (at != tiles.end() && at->tile == entry.tile) {
    *at = entry;
  } else {
    tiles.insert(at, entry);
  }
}

Outcome check_index(const MapIndex& index) {
  const MapFrame& f = index.frame;
  if (!plausible(f.datum)) return Error{"the datum is not a position on the earth"};
  if (std::isinf(f.undulation_m) || std::abs(f.undulation_m) > 120.0) {
    return Error{"the undulation must be in [-120, 120] m"};
  }
  for (const std::string* text : {&f.reference, &f.heights, &f.source_crs}) {
    if (text->size() > kMaxText) return Error{"a name is longer than 1024 characters"};
  }
  if (f.reference.empty() || f.heights.empty()) {
    return Error{"reference frame or heights without a name"};
  }
  if (index.levels.empty() || index.levels.size() > kMaxLevels) {
    return Error{"a map has 1 to 16 levels"};
  }
  double finer_m = 0.0;
  for (const MapLevelIndex& level : index.levels) {
    if (Outcome checked = check_level(level.level); !checked) return checked;
    if (!(level.level.cell_m > finer_m)) return Error{"levels must go from fine to coarse"};
    finer_m = level.level.cell_m;
    for (const MapTileEntry& e : level.tiles) {
      if (e.points > kMaxSurfacePoints) return Error{"a tile has too many surface points"};
      if (!plausible_tile(e.tile)) return Error{"a tile's number is beyond 2^22"};
    }
    for (std::size_t k = 1; k < level.tiles.size(); ++k) {
      if (!before(level.tiles[k - 1].tile, level.tiles[k].tile)) {
        return Error{"tiles are out of order or repeated"};
      }
    }
  }
  return Done{};
}

std::vector<std::uint8_t> encode_index(const MapIndex& index) {
  RCS_CHECK(check_index(index).ok());
  wire::Writer w;
  w.bytes.assign(kIndexHeaderSize, 0);
  std::memcpy(w.bytes.data(), kIndexMagic, kIndexMagicSize);
  const bool points = with_points(index);
  wire::put(points ? kIndexVersionWithPoints : kIndexVersion, w.bytes.data() + kIndexMagicSize);
  const MapFrame& f = index.frame;
  put_datum(f.datum, &w);
  w.put(f.undulation_m);
  w.put(f.reference);
  w.put(f.heights);
  w.put(f.source_crs);
  w.put(static_cast<std::uint32_t>(index.levels.size()));
  for (const MapLevelIndex& level : index.levels) {
    put_cells(level.level, &w);
    w.put(level.level.bias_sigma_m);
    w.put(level.level.bias_correlation_m);
    w.put(static_cast<std::uint32_t>(level.tiles.size()));
    for (const MapTileEntry& e : level.tiles) {
      w.put(static_cast<std::int32_t>(e.tile.i));
      w.put(static_cast<std::int32_t>(e.tile.j));
      w.put(e.checksum);
      w.put(e.known);
      w.put(e.low_m);
      w.put(e.high_m);
      if (points) w.put(e.points);
    }
  }
  wire::put(crc32(w.bytes.data() + kIndexHeaderSize, w.bytes.size() - kIndexHeaderSize),
            w.bytes.data() + 12);
  return std::move(w.bytes);
}

Result<MapIndex> decode_index(const std::vector<std::uint8_t>& bytes) {
  const std::uint8_t* in = bytes.data();
  if (bytes.size() < kIndexHeaderSize) return Error{"truncated"};
  if (std::memcmp(in, kIndexMagic, kIndexMagicSize) != 0) return Error{"not a map's index (magic)"};
  const auto version = wire::take<std::uint32_t>(in + kIndexMagicSize);
  if (version != kIndexVersion && version != kIndexVersionWithPoints) {
    return Error{"unsupported version " + std::to_string(version) + ", supported are 1 and 2"};
  }
  const bool points = version == kIndexVersionWithPoints;
  if (crc32(in + kIndexHeaderSize, bytes.size() - kIndexHeaderSize) !=
      wire::take<std::uint32_t>(in + 12)) {
    return Error{"truncated or corrupt: the checksum differs"};
  }
  wire::Reader r(in + kIndexHeaderSize, bytes.size() - kIndexHeaderSize);
  MapIndex index;
  MapFrame& f = index.frame;
  f.datum.lat_rad = r.take<double>();
  f.datum.lon_rad = r.take<double>();
  f.datum.height.m = r.take<double>();
  f.undulation_m = r.take<double>();
  f.reference = r.take_text();
  f.heights = r.take_text();
  f.source_crs = r.take_text();
  const auto levels = r.take<std::uint32_t>();
  for (std::uint32_t k = 0; k < levels && r.ok() && k < kMaxLevels; ++k) {
    MapLevelIndex level;
    level.level.cell_m = r.take<double>();
    level.level.origin_m.x() = r.take<double>();
    level.level.origin_m.y() = r.take<double>();
    level.level.bias_sigma_m = r.take<double>();
    level.level.bias_correlation_m = r.take<double>();
    const std::size_t tiles = r.take<std::uint32_t>();
    if (tiles > r.left() / (kEntrySize + (points ? kIndexCountSize : 0))) {
      return Error{"truncated: more tiles than bytes"};
    }
    level.tiles.resize(tiles);
    for (MapTileEntry& e : level.tiles) {
      e.tile.i = r.take<std::int32_t>();
      e.tile.j = r.take<std::int32_t>();
      e.checksum = r.take<std::uint32_t>();
      e.known = r.take<std::uint32_t>();
      e.low_m = r.take<float>();
      e.high_m = r.take<float>();
      if (points) e.points = r.take<std::uint32_t>();
    }
    index.levels.push_back(std::move(level));
  }
  if (!r.ok() || r.left() != 0 || index.levels.size() != levels) {
    return Error{"its counts do not match its size"};
  }
  if (Outcome checked = check_index(index); !checked) return checked.error();
  return index;
}

}  // namespace rcs

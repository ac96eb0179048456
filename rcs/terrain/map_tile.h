#pragma once
// A map's tile: 256 x 256 cells of one level in one file.
//
// Little-endian:
//   0  char[8]  "RCSTILE\n"
//   8  u32      version: 1, or 2 with points
//  12  u32      CRC-32 (IEEE 802.3) of the rest, from offset 16
//  16  u64      lattice: hash of the map's frame and the level (lattice_id())
//  24  i32 x 2  which tile: covers cells 256 * (i, j) to 256 * (i, j) + 255
//  32  f64 x 5  cell [m]; origin x, y [m]; bias sigma [m]; bias correlation length [m]
//  72  u32      flags: sigma (1), count (2), date (4), source (8) by cell, else one for all
//  76  f32      sigma [m]         | these hold
//  80  u16 x 2  count; date       | for all cells
//  84  u8 x 4   source; 0; 0; 0   | where not flagged
//  88  f32[]    heights [m], row by row from the south, west first; NaN: unknown
//      f32[]    sigma; u16[] count; u16[] date; u8[] source: each if flagged
// Version 2 continues with surface points of above-ground structure:
//      u32      number of points, 1 to kMaxSurfacePoints
//      f32 x 7  each: x, y from the tile's corner, z [m]; unit normal; sigma [m]

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/raster.h"

namespace rcs {

constexpr int kTileSide = 256;  ///< cells
constexpr std::size_t kTileCells = std::size_t{kTileSide} * kTileSide;
constexpr std::size_t kMaxTileBytes =
    88 + kTileCells * (4 + 4 + 2 + 2 + 1) + 4 + kMaxSurfacePoints * kSurfacePointBytes;

/// The tile that holds a cell, in tiles.
[[nodiscard]] inline Cell tile_of(Cell c) { return {c.i >> 8, c.j >> 8}; }
/// True if the numbers of its cells, and those of their neighbours, are ints.
[[nodiscard]] inline bool plausible_tile(Cell tile) {
  constexpr int kFarthest = 1 << 22;
  return -kFarthest <= tile.i && tile.i < kFarthest && -kFarthest <= tile.j && tile.j < kFarthest;
}
[[nodiscard]] inline Cell first_cell(Cell tile) { return {tile.i * kTileSide, tile.j * kTileSide}; }

/// @param tile  kTileSide x kTileSide cells whose first one is a tile's; passes check_raster(); at
///   most kMaxSurfacePoints surface points
[[nodiscard]] std::vector<std::uint8_t> encode_tile(const Raster& tile, std::uint64_t lattice);

/// No length in the bytes is accepted before it is checked against their number. An error unless
/// the checksum is right and the tile belongs to this lattice.
[[nodiscard]] Result<Raster> decode_tile(const std::uint8_t* bytes, std::size_t size,
                                         std::uint64_t lattice);

}  // namespace rcs

#pragma once
// The a priori map's file: elevation tiles with their uncertainty.
//
// A file is one or more records, one after the other; everything is little-endian:
//   0  char[8]  "RCSELEV\n"
//   8  u32      version = 1
//  12  u32      CRC-32 (IEEE 802.3) of the rest of the record, from offset 16
//  16  i64      tile id
//  24  f64 x 4  datum: latitude [rad], longitude [rad], ellipsoidal height [m]; undulation [m]
//  56  f64 x 3  origin x, y [m, frame world]; cell [m]
//  80  f64 x 3  sigma [m]; bias sigma [m]; bias correlation length [m]
// 104  u32 x 3  width, height, flags (bit 0: a sigma for every cell follows the heights)
// 116  f32[]    heights [m], row by row from the south, west first; NaN: unknown
//      f32[]    sigma [m] of every cell, if flagged

#include <cstdint>
#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/linear.h"
#include "rcs/base/result.h"

namespace rcs {

/// A rectangle of ground heights in frame `world`: the east-north-up tangent frame at `datum`.
/// Cell (i, j) covers origin + [i, i+1) x [j, j+1) * cell_m, and its height is that of the centre.
struct ElevationTile {
  std::int64_t id = 0;
  Geodetic datum;
  /// Geoid above the ellipsoid at the datum [m], by which the source's orthometric heights were
  /// converted; NaN: the source was ellipsoidal.
  double undulation_m = 0.0;
  Vec2 origin_world_m = Vec2::Zero();  ///< the south-western corner of cell (0, 0)
  double cell_m = 0.0;
  int width = 0;                 ///< cells along x
  int height = 0;                ///< cells along y
  std::vector<float> z_world_m;  ///< above the tangent plane, x fastest; NaN: unknown
  /// Standard deviation of (ground - interpolated height) at a point, without the slow bias.
  double sigma_m = 0.0;
  std::vector<float> cell_sigma_m;  ///< the same by cell, or empty: sigma_m everywhere
  /// The survey's slow error: first-order Gauss-Markov in distance.
  double bias_sigma_m = 0.0;
  double bias_correlation_m = 0.0;
};

constexpr int kMaxTileSide = 16384;  ///< cells

/// Why a tile can't be used (sizes, units, non-finite numbers); Done when it can.
[[nodiscard]] Outcome check_tile(const ElevationTile& tile);

/// One record. The tile must pass check_tile().
[[nodiscard]] std::vector<std::uint8_t> encode_tile(const ElevationTile& tile);

/// All records of a file's bytes. `name` is for error messages. Nothing in the bytes is believed
/// before it is bounded by the bytes that are left.
[[nodiscard]] Result<std::vector<ElevationTile>> decode_tiles(
    const std::vector<std::uint8_t>& bytes, const std::string& name);

/// Writes a file with the given tiles, in order.
[[nodiscard]] Outcome write_tiles(const std::vector<ElevationTile>& tiles, const std::string& path);
[[nodiscard]] Outcome write_tile(const ElevationTile& tile, const std::string& path);

[[nodiscard]] Result<std::vector<ElevationTile>> read_tiles(const std::string& path);

}  // namespace rcs

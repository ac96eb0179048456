#pragma once
// Reads point clouds: PCD (0.7: ascii, binary), PLY (ascii, binary_little_endian), .bin of KITTI
// (x, y, z, intensity as float32) and .xyz (one point per line).

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/result.h"

namespace rcs::clouds {

struct Cloud {
  Points points;                ///< [m]; finite, none at the origin, none beyond 10 km
  std::int64_t no_return = 0;   ///< skipped: not finite, at the origin, or beyond 10 km
  std::int64_t not_finite = 0;  ///< of no_return
  std::int64_t far = 0;         ///< of no_return: beyond 10 km
  /// Size of an organized PCD, row 0 first; 0 x 0: not organized.
  int rows = 0;
  int cols = 0;
  std::vector<std::int32_t> cell;  ///< row * cols + col of each point; empty: not organized
};

/// The rows and columns of a range image, if its records are given row by row.
struct CloudShape {
  int rows = 0;  ///< 0: from the file (only PCD)
  int cols = 0;
};

/// @param name  ends in .pcd, .ply, .bin or .xyz; errors begin with it
[[nodiscard]] Result<Cloud> parse_cloud(const std::vector<std::uint8_t>& bytes,
                                        const std::string& name, const CloudShape& shape);

/// "7 of 100 points skipped: 5 not finite, 2 at the origin"; empty: no point was skipped.
[[nodiscard]] std::string skipped_text(const Cloud& cloud);

/// Keeps the first of coincident points. @return number of dropped points
std::size_t drop_coincident(Cloud* cloud);

[[nodiscard]] Result<Cloud> read_cloud(const std::string& path, const CloudShape& shape);

}  // namespace rcs::clouds

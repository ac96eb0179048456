#pragma once
// Comparison of two maps of the same ground.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/raster.h"
#include "tools/mapping/resample.h"

namespace rcs::survey {

/// Shares of the differences within one and two of their standard deviations, [0, 1]; 0.683 and
/// 0.954 for normal errors.
struct Within {
  double one = 0.0;
  double two = 0.0;
};

/// Statistics of the second map minus the first, over the cells known to both.
struct MapDifference {
  std::int64_t cells = 0;
  double mean_m = 0.0;
  double median_m = 0.0;
  double rms_m = 0.0;
  double nmad_m = 0.0;  ///< 1.4826 times the median of |d - median|: sigma without the outliers
  double p95_m = 0.0;   ///< of |d|
  Within by_sigma;      ///< by the sigmas of both maps
  Within with_bias;     ///< by the sigmas and systematic errors of both
};

/// Accumulates differences; 4 bytes each.
class Differences {
 public:
  /// @param a, b  the same cells of the same lattice
  void add(const Raster& a, const Raster& b);
  /// Zeros without differences.
  [[nodiscard]] MapDifference metrics() const;

 private:
  std::vector<float> d_m_;
  std::array<std::int64_t, 4> within_{};  // sigma: one, two; with bias: one, two
};

/// Called with the completed share, [0, 1]; returns false to stop.
using Going = std::function<bool(double)>;

/// @param level  of `a`: whose cells are compared
/// @param b  opened for cells of that size
/// @return an error if a tile can't be read, or no cell is known to both
[[nodiscard]] Result<MapDifference> difference_of(const MapFolder& a, int level,
                                                  mapping::MapResampler* b, const Going& going);

/// b - a as heights of a raster, cropped to the cells known to both.
/// @return as above, and an error for a level of more than 2^26 cells
[[nodiscard]] Result<Raster> difference_raster(const MapFolder& a, int level,
                                               mapping::MapResampler* b, const Going& going);

/// Red, green, blue, opacity: white at 0, blue at -range_m and below, red at range_m and above;
/// NaN is transparent.
[[nodiscard]] std::array<std::uint8_t, 4> difference_color(float d_m, double range_m);

/// PNG, north up, one pixel per cell.
[[nodiscard]] Outcome write_difference(const Raster& difference, double range_m,
                                       const std::string& path);

}  // namespace rcs::survey

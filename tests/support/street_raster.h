#pragma once
// Places for the match of a scan to a raster: simulated streets, and surveyed ground of which the
// raster and the scan are disjoint parts. The scan never contains the errors of the raster.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "rcs/base/points.h"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/terrain/elevation_map.h"
#include "rcs/terrain/raster.h"

namespace rcs::test {

/// z(x, y) [m] in the frame of the map; NaN: unknown.
using GroundHeight = std::function<double(double, double)>;

/// A vehicle with a scan, and the ground of which a raster is made.
struct RasterPlace {
  std::string name;
  GroundHeight ground;
  Pose T_map_vehicle;  ///< reference
  Points scan;         ///< vehicle frame
};

struct StreetParams {
  double slope_rad = 0.0;  ///< root mean square of the slopes along the street
  bool kerbs = true;       ///< with driveways, and a side street
  std::uint32_t seed = 0;  ///< of the street, of what stands on it, and of the scan
};
/// A street with a crown of 2 %, parked cars, and buildings on both sides, in a random direction.
/// The scan has the rays of two stacked spinning LADARs with an error of 0.02 m.
[[nodiscard]] RasterPlace simulated_street(const StreetParams& params);

/// A place on the ground of a raster (smoothed over 3 x 3 cells: these heights may be rounded) with
/// a simulated scan.
/// @return an error if the raster has no place with known ground around it
[[nodiscard]] Result<RasterPlace> place_on_raster(const Raster& raster, std::uint32_t seed);

/// A place of a surveyed point cloud: the ground points are split at random into two halves; the
/// raster interpolates one half linearly, the scan is the other half with the vegetation, within
/// 40 m.
struct Survey {
  std::vector<Vec3> ground;      ///< [m], about the centre
  std::vector<Vec3> vegetation;  ///< likewise
};
/// @param path  .las or .xyz
[[nodiscard]] Result<Survey> read_survey(const std::string& path, int class_column, double unit_m);
[[nodiscard]] RasterPlace surveyed_place(const Survey& survey, std::uint32_t seed);

struct RasterErrors {
  double cell_m = 0.3;
  double sigma_m = 0.05;       ///< of the errors that are added to the heights; 0: none
  double correlation_m = 0.0;  ///< of a Gaussian filter; 0: white
  double stated_m = 0.05;      ///< sigma in the map
  std::uint32_t seed = 0;
};
/// Adds errors to the heights of a raster; the correlation is that of a Gaussian filter, 0: white.
void add_errors(double sigma_m, double correlation_m, std::uint32_t seed, Raster* raster);

/// The map has coarser levels as an imported one.
[[nodiscard]] ElevationMap raster_map(const RasterPlace& place, const RasterErrors& errors);

}  // namespace rcs::test

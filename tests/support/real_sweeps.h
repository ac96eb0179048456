#pragma once
// The two real sweeps of av2_pittsburgh, with the real raster of the ground of the street.

#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "rcs/terrain/raster.h"
#include "tests/support/street_raster.h"

namespace rcs::test {

constexpr const char* kPittsburghLog = "/av2_pittsburgh/7fab2350-7eaf-3b7e-a39d-6937a4c1bede";

struct RealSweeps {
  std::vector<RasterPlace> places;  ///< without `ground`: the raster is given
  MapFrame frame;
  Raster raster;  ///< 0.3 m
};

/// @param data  folder of all real data (RCS_DATA_DIR)
/// @param stated_m  sigma of the raster
[[nodiscard]] Result<RealSweeps> pittsburgh_sweeps(const std::string& data, double stated_m);

/// The map has coarser levels as an imported one.
[[nodiscard]] ElevationMap map_of(const MapFrame& frame, const Raster& raster);

}  // namespace rcs::test

#pragma once
// Elevation rasters, read by GDAL, made into maps: their coordinate reference system and vertical
// datum are PROJ's to convert.

#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "rcs/base/result.h"
#include "rcs/terrain/raster.h"
#include "tools/survey/npy_raster.h"
#include "tools/survey/survey_coordinates.h"

namespace rcs::survey {

/// What is read. Other formats of GDAL's may name files and servers, which it would read, too.
constexpr const char* kRasterFormats =
    "GeoTIFF, ESRI ASCII grid, ESRI .flt and .bil, ENVI, SRTM .hgt, DTED, USGS DEM, Surfer grid";

struct RasterImport : SurveyCoordinates {
  std::string path;
  int band = 1;
  std::optional<double> nodata;  ///< the file's value that means: none; empty: as the file says
  double cell_m = 0.0;           ///< of the map; 0: the raster's own spacing
  SurveyQuality quality;
  CellSource source = CellSource::kAerial;
};

struct RasterImported {
  MapFrame frame;
  double cell_m = 0.0;
  std::int64_t known = 0;    ///< cells
  std::int64_t unknown = 0;  ///< cells of the raster's extent, its holes among them
};

/// Writes the map. Its axes are east, north and up at the raster's middle; the reference frame is
/// that of the raster. A cell's sigma is the survey's and, added in squares, what linear
/// interpolation misses between the raster's nodes, told from what it misses between every other of
/// them.
/// @param progress  told the share that is done, asked whether to go on
[[nodiscard]] Result<RasterImported> import_raster(const RasterImport& wanted,
                                                   const std::string& map,
                                                   const std::function<bool(double)>& progress);

}  // namespace rcs::survey

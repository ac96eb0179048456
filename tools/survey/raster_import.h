#pragma once
// Imports elevation rasters as maps: read by GDAL, with coordinate reference system and vertical
// datum converted by PROJ.

#include <functional>
#include <limits>
#include <optional>
#include <string>

#include "rcs/base/result.h"
#include "rcs/terrain/raster.h"
#include "tools/survey/npy_raster.h"
#include "tools/survey/survey_coordinates.h"

namespace rcs::survey {

/// Supported formats. Other formats of GDAL may refer to files and servers, which it would read.
constexpr const char* kRasterFormats =
    "GeoTIFF, ESRI ASCII grid, ESRI .flt and .bil, ENVI, SRTM .hgt, DTED, USGS DEM, Surfer grid";

struct RasterImport : SurveyCoordinates {
  std::string path;
  int band = 1;
  std::optional<double> nodata;  ///< value without data; nullopt: from the file
  double cell_m = 0.0;           ///< of the map; 0: spacing of the raster
  SurveyQuality quality;
  CellSource source = CellSource::kAerial;
};

struct RasterImported {
  MapFrame frame;
  double cell_m = 0.0;
  std::int64_t known = 0;    ///< cells
  std::int64_t unknown = 0;  ///< cells of the extent of the raster, including holes
};

/// Writes the map. Its axes are east, north and up at the centre of the raster; the reference frame
/// is that of the raster. The variance of a cell is that of the survey plus that of the linear
/// interpolation between the nodes of the raster, estimated from the interpolation between every
/// other node.
/// @param progress  called with the completed share; returns false to stop
[[nodiscard]] Result<RasterImported> import_raster(const RasterImport& wanted,
                                                   const std::string& map,
                                                   const std::function<bool(double)>& progress);

}  // namespace rcs::survey

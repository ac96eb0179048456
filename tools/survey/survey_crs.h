#pragma once
// The coordinate reference system of a point cloud file.

#include <ogr_spatialref.h>

#include <optional>

#include "rcs/base/result.h"
#include "tools/clouds/survey_points.h"

namespace rcs::survey {

/// GeoTIFF keys are interpreted by GDAL, through a TIFF of one pixel with these keys.
/// @return nullopt: none in the file; an error, without the file name, if it can't be interpreted
[[nodiscard]] Result<std::optional<OGRSpatialReference>> survey_crs(const clouds::SurveyCrs& file);

}  // namespace rcs::survey

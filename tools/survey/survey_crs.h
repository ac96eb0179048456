#pragma once
// A cloud's coordinate reference system, as its file has it.

#include <ogr_spatialref.h>

#include <optional>

#include "rcs/base/result.h"
#include "tools/clouds/survey_points.h"

namespace rcs::survey {

/// GeoTIFF's keys are GDAL's to understand: it is shown a TIFF of one pixel that has them.
/// @return empty: the file says none; an error, without the file's name, when what it says can't be
///   understood
[[nodiscard]] Result<std::optional<OGRSpatialReference>> survey_crs(const clouds::SurveyCrs& file);

}  // namespace rcs::survey

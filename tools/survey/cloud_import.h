#pragma once
// Imports surveyed point clouds as maps of the ground.

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "tools/mapping/bare_earth.h"
#include "tools/mapping/survey_ground.h"
#include "tools/survey/npy_raster.h"
#include "tools/survey/point_density.h"
#include "tools/survey/survey_coordinates.h"

namespace rcs::survey {

struct CloudImport : SurveyCoordinates {
  std::vector<std::string> paths;  ///< of one survey, in one coordinate reference system
  int class_column = 0;            ///< of .xyz and .txt, from 1; 0: none
  /// ASPRS classes of ground: 2, and 8, key points in LAS up to 1.3. If no point has one of them,
  /// the ground is detected by its shape (bare_earth()).
  std::vector<int> ground_classes = {2, 8};
  bool ignore_classes = false;  ///< always detect the ground by its shape
  mapping::BareEarthParams bare_earth;
  double cell_m = 0.0;        ///< of the map, [0.05, 100]; 0: cell_of_density()
  double memory_bytes = 4e9;  ///< limit
  SurveyQuality quality;
  CellSource source = CellSource::kAerial;
};

struct CloudImported {
  MapFrame frame;
  double cell_m = 0.0;          ///< of the map
  DensityMetrics density;       ///< of the candidates: points of ground classes, or last returns
  bool by_classes = false;      ///< else by their shape
  std::int64_t points = 0;      ///< in the files
  std::int64_t invalid = 0;     ///< of them: flagged as withheld, or not finite
  std::int64_t noise = 0;       ///< classes 7 and 18
  std::int64_t unplaced = 0;    ///< outside the area of the projection or the geoid grid
  std::int64_t not_ground = 0;  ///< all other points that are not ground
  std::array<std::int64_t, 256> by_class{};
  mapping::SurveyGroundMetrics ground;
};

/// Writes the map. Its axes are east, north and up at the centre of the extent of the points; the
/// reference frame is that of the survey. The height of a cell is the mean of its ground points
/// without outliers; its sigma is that of the survey or, if larger, the standard deviation of the
/// points, reduced by averaging. Cells without a ground point are unknown. Reads the files three or
/// four times; memory is proportional to the area.
/// @param progress  called with the completed share; returns false to stop
[[nodiscard]] Result<CloudImported> import_cloud(const CloudImport& wanted, const std::string& map,
                                                 const std::function<bool(double)>& progress);

}  // namespace rcs::survey

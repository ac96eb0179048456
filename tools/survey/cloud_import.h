#pragma once
// Surveys as point clouds, from the air or the ground, made into maps of the ground.

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
#include "tools/survey/survey_coordinates.h"

namespace rcs::survey {

struct CloudImport : SurveyCoordinates {
  std::vector<std::string> paths;  ///< of one survey, in one coordinate reference system
  int class_column = 0;            ///< of .xyz and .txt, from 1; 0: none
  /// Classes of the ASPRS's that are ground: 2, and 8, key points of it in LAS up to 1.3. Where no
  /// point is of one of them, the ground is found by its shape (bare_earth()).
  std::vector<int> ground_classes = {2, 8};
  bool ignore_classes = false;  ///< the ground is found by its shape anyway
  mapping::BareEarthParams bare_earth;
  double cell_m = 1.0;        ///< of the map, [0.05, 100]
  double memory_bytes = 4e9;  ///< at most
  SurveyQuality quality;
  CellSource source = CellSource::kAerial;
};

struct CloudImported {
  MapFrame frame;
  bool by_classes = false;      ///< else by their shape
  std::int64_t points = 0;      ///< in the files
  std::int64_t invalid = 0;     ///< of them: withheld, or not finite
  std::int64_t noise = 0;       ///< classes 7 and 18
  std::int64_t unplaced = 0;    ///< where the projection or the geoid's grid does not reach
  std::int64_t not_ground = 0;  ///< the rest but the ground's
  std::array<std::int64_t, 256> by_class{};
  mapping::SurveyGroundFigures ground;
};

/// Writes the map. Its axes are east, north and up at the middle of the points' extent; the
/// reference frame is that of the survey. A cell's height is the mean of its points of the ground,
/// without those that stand off; its sigma the survey's, or the points' spread where that is
/// larger, and what is left of it in the mean. Cells without a point of the ground are unknown.
/// Reads the files two or three times; memory grows by the area.
/// @param progress  told the share that is done, asked whether to go on
[[nodiscard]] Result<CloudImported> import_cloud(const CloudImport& wanted, const std::string& map,
                                                 const std::function<bool(double)>& progress);

}  // namespace rcs::survey

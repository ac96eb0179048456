#pragma once
// Options of the user for the coordinates of a survey, if missing or wrong in its file.

#include <optional>
#include <string>

namespace rcs::survey {

struct SurveyCoordinates {
  std::string crs;  ///< "EPSG:32611", if missing or wrong in the file; empty: from the file
  /// Reference of the heights: "ellipsoid", "EGM96", "EGM2008", "EPSG:5703", ...; empty: from the
  /// coordinate reference system.
  std::string heights;
  /// Geoid above the ellipsoid [m], instead of the grid of PROJ for `heights`.
  std::optional<double> undulation_m;
  /// Unit of the heights in metres, after scale and offset of the band; 0: from the band, else from
  /// its vertical system or that of `heights`, else 1.
  double height_unit_m = 0.0;
};

}  // namespace rcs::survey

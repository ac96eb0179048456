#pragma once
// What the user says of a survey's coordinates, where its file does not, or wrongly.

#include <optional>
#include <string>

namespace rcs::survey {

struct SurveyCoordinates {
  std::string crs;  ///< "EPSG:32611", if the file has none or a wrong one; empty: the file's
  /// What the heights are above: "ellipsoid", "EGM96", "EGM2008", "EPSG:5703", ...; empty: as the
  /// coordinate reference system says.
  std::string heights;
  /// Geoid above the ellipsoid [m], instead of PROJ's grid for `heights`.
  std::optional<double> undulation_m;
  /// Of the file's heights, a band's scale and offset applied; 0: as the band, else its vertical
  /// system or that of `heights`, says; else 1.
  double height_unit_m = 0.0;
};

}  // namespace rcs::survey

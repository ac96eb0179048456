#pragma once
// Georeference of a survey: its coordinate reference system, the reference of its heights, its
// extent, and the transforms between its coordinates and the frame of the map.

#include <ogr_spatialref.h>

#include <array>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/linear.h"
#include "rcs/base/result.h"
#include "rcs/terrain/map_index.h"
#include "tools/survey/gdal_files.h"
#include "tools/survey/survey_coordinates.h"

namespace rcs::survey {

/// A position of the frame of the map at two heights, for interpolation.
struct Knot {
  static constexpr double kTall_m = 1000.0;
  std::array<Vec2, 2> pixel;              ///< column, row at z = 0 and z = kTall_m
  std::array<double, 2> ellipsoidal_m{};  ///< heights there
  double undulation_m = 0.0;
};

class SurveyFrame {
 public:
  /// @param band  of the heights; used only during this call
  [[nodiscard]] static Result<SurveyFrame> find(const SurveyCoordinates& wanted,
                                                GDALRasterBand* band);
  /// For points. Heights without a unit in the file or from the user are in metres only if the
  /// coordinates are in metres or degrees.
  /// @param own  system of the file; nullptr: none
  /// @param low, high  corners of the extent of the points, in the coordinates of the file
  [[nodiscard]] static Result<SurveyFrame> find(const SurveyCoordinates& wanted,
                                                const OGRSpatialReference* own, const Vec2& low,
                                                const Vec2& high);

  [[nodiscard]] const MapFrame& map() const { return map_; }
  [[nodiscard]] double unit_m() const { return unit_m_; }    ///< of the heights of the band
  [[nodiscard]] double pixel_m() const { return pixel_m_; }  ///< side of the central pixel
  [[nodiscard]] const Vec2& low() const { return low_; }    ///< corners of the extent of the raster
  [[nodiscard]] const Vec2& high() const { return high_; }  ///< in the frame of the map
  /// nullopt: outside the area of the projection or the geoid grid.
  [[nodiscard]] std::optional<Knot> knot(const Vec2& place_m) const;
  /// Transforms points of the file, fewer than 2^31, to the frame of the map, in place; NaN: as
  /// with knot().
  void to_map(std::vector<double>* x, std::vector<double>* y, std::vector<double>* z) const;

 private:
  struct DestroyTransform {
    void operator()(OGRCoordinateTransformation* t) const {
      OGRCoordinateTransformation::DestroyCT(t);
    }
  };
  using Transform = std::unique_ptr<OGRCoordinateTransformation, DestroyTransform>;

  SurveyFrame() = default;
  [[nodiscard]] Outcome find_frame(const SurveyCoordinates& wanted, const OGRSpatialReference* own);
  [[nodiscard]] Outcome find_unit(const SurveyCoordinates& wanted, const std::string& own);
  [[nodiscard]] Outcome find_point_unit(const SurveyCoordinates& wanted);
  [[nodiscard]] Result<double> find_system_unit(const std::string& heights) const;
  [[nodiscard]] Outcome find_heights(const SurveyCoordinates& wanted);
  [[nodiscard]] Outcome find_extent(double cols, double rows);
  [[nodiscard]] std::optional<Vec2> pixel_of(const Geodetic& g) const;
  [[nodiscard]] std::optional<Geodetic> geodetic_of(const Vec2& pixel) const;
  [[nodiscard]] std::optional<double> undulation_at(const Geodetic& g) const;

  std::array<double, 6> affine_{};   // pixel to projected
  std::array<double, 6> inverse_{};  // projected to pixel
  OGRSpatialReference crs_, geographic_;
  Transform to_crs_, to_geographic_;
  Transform to_ellipsoid_;              // by the grid of PROJ,
  std::optional<double> undulation_m_;  // or by this; neither: heights are above the ellipsoid
  double unit_m_ = 1.0;
  double pixel_m_ = 0.0;
  MapFrame map_;
  std::optional<LocalFrame> local_;
  Vec2 low_, high_;
};

}  // namespace rcs::survey

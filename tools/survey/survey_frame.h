#pragma once
// Where a survey's raster or points lie: its coordinate reference system, what its heights are
// above, its extent, and the ways between the map's frame and its own.

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

/// A place of the map's frame at two heights: between such it is interpolated.
struct Knot {
  static constexpr double kTall_m = 1000.0;
  std::array<Vec2, 2> pixel;              ///< column, row at z = 0 and z = kTall_m
  std::array<double, 2> ellipsoidal_m{};  ///< heights there
  double undulation_m = 0.0;
};

class SurveyFrame {
 public:
  /// @param band  where heights are read; needed no longer than this call
  [[nodiscard]] static Result<SurveyFrame> find(const SurveyCoordinates& wanted,
                                                GDALRasterBand* band);
  /// Of points. Heights whose unit neither their file nor the user names are in metres only where
  /// its coordinates are in metres or degrees.
  /// @param own  the file's system; null: it says none
  /// @param low, high  corners of the points' extent, in the file's coordinates
  [[nodiscard]] static Result<SurveyFrame> find(const SurveyCoordinates& wanted,
                                                const OGRSpatialReference* own, const Vec2& low,
                                                const Vec2& high);

  [[nodiscard]] const MapFrame& map() const { return map_; }
  [[nodiscard]] double unit_m() const { return unit_m_; }    ///< of the band's heights
  [[nodiscard]] double pixel_m() const { return pixel_m_; }  ///< side of the middle one
  [[nodiscard]] const Vec2& low() const { return low_; }     ///< corners of the raster's extent
  [[nodiscard]] const Vec2& high() const { return high_; }   ///< in the map's frame
  /// Empty: the projection, or the geoid's grid, does not reach there.
  [[nodiscard]] std::optional<Knot> knot(const Vec2& place_m) const;
  /// Points of the file, fewer than 2^31, to the map's frame, in place; NaN: as with knot().
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
  Transform to_ellipsoid_;              // by PROJ's grid,
  std::optional<double> undulation_m_;  // or by this; neither: heights are above the ellipsoid
  double unit_m_ = 1.0;
  double pixel_m_ = 0.0;
  MapFrame map_;
  std::optional<LocalFrame> local_;
  Vec2 low_, high_;
};

}  // namespace rcs::survey

#pragma once
// The bare earth in an unclassified aerial point cloud: the simple
// morphological filter (SMRF) of Pingel, Clarke and McBride, "An improved simple morphological
// filter for the terrain classification of airborne LIDAR data", ISPRS Journal of Photogrammetry
// and Remote Sensing 77 (2013). Squares are opened instead of disks.

#include "rcs/base/linear.h"
#include "rcs/terrain/raster.h"

namespace rcs::mapping {

/// Names of the paper are in brackets; the values are the defaults of the filter in PDAL.
struct BareEarthParams {
  double slope = 0.15;        ///< max slope of the ground between cells [s], (0, 5]
  double largest_m = 18.0;    ///< half the width of the largest object [w], [1, 200]
  double above_m = 0.5;       ///< max height of ground points above it, [0.01, 10] [et]
  double above_slope = 1.25;  ///< increase of above_m with the slope [es], [0, 10]
};

/// Keeps the lowest height of a cell. Points outside the raster are ignored.
void lower(Raster* lowest, const Vec3& p);

/// @param lowest  heights of the lowest points; NaN: none
/// @return heights of the ground; NaN in cells of objects, and of points far below their
///   surroundings
[[nodiscard]] Raster bare_earth(const Raster& lowest, const BareEarthParams& params);

/// Fills unknown cells by a membrane between the known ones.
/// @param heights  at least one known cell
[[nodiscard]] Raster bridged(const Raster& heights);

/// Means over 3 x 3 cells, weighted 1 2 1 along each axis.
/// @param surface  all known
[[nodiscard]] Raster smoothed(const Raster& surface);

/// Height and gradient of a surface.
struct SurfaceHere {
  double z_m = 0.0;
  Vec2 gradient = Vec2::Zero();
};

/// Bilinear between the centres of cells; constant beyond the outermost ones.
/// @param surface  all known
[[nodiscard]] SurfaceHere surface_at(const Raster& surface, double x_m, double y_m);

/// Maximum vertical distance of a ground point from the surface [m].
[[nodiscard]] inline double ground_reach(const BareEarthParams& params, const SurfaceHere& at) {
  return params.above_m + params.above_slope * at.gradient.norm();
}

}  // namespace rcs::mapping

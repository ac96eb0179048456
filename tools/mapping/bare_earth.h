#pragma once
// The bare earth under a survey's points from the air whose classes nobody has told: the simple
// morphological filter (SMRF) of Pingel, Clarke and McBride, "An improved simple morphological
// filter for the terrain classification of airborne LIDAR data", ISPRS Journal of Photogrammetry
// and Remote Sensing 77 (2013). Squares are opened instead of disks.

#include "rcs/base/linear.h"
#include "rcs/terrain/raster.h"

namespace rcs::mapping {

/// The paper's names are in brackets; the values are the defaults of PDAL's filter of that name.
struct BareEarthParams {
  double slope = 0.15;        ///< that the ground seldom has from cell to cell [s], (0, 5]
  double largest_m = 18.0;    ///< half the width of what stands on the ground [w], [1, 200]
  double above_m = 0.5;       ///< above the ground a point may be its, [0.01, 10] [et]
  double above_slope = 1.25;  ///< and so much more by slope [es], [0, 10]
};

/// Keeps a cell's lowest height. What lies outside the raster is left out.
void lower(Raster* lowest, const Vec3& p);

/// @param lowest  heights of the lowest points; NaN: none
/// @return of them those on the ground; NaN in cells of things that stand on it, and of points far
///   below all around them
[[nodiscard]] Raster bare_earth(const Raster& lowest, const BareEarthParams& params);

/// A surface over all cells: what is unknown is bridged as by a membrane, the known ones stay.
/// @param heights  one is known at least
[[nodiscard]] Raster bridged(const Raster& heights);

/// Means over 3 x 3 cells, weighted 1 2 1 each way.
/// @param surface  all known
[[nodiscard]] Raster smoothed(const Raster& surface);

/// A surface at a place, and how steep it is there.
struct SurfaceHere {
  double z_m = 0.0;
  Vec2 gradient = Vec2::Zero();
};

/// Bilinear between the cells' centres; beyond the outermost ones as there.
/// @param surface  all known
[[nodiscard]] SurfaceHere surface_at(const Raster& surface, double x_m, double y_m);

/// How much higher than the surface a point of the ground may be, or lower [m].
[[nodiscard]] inline double ground_reach(const BareEarthParams& params, const SurfaceHere& at) {
  return params.above_m + params.above_slope * at.gradient.norm();
}

}  // namespace rcs::mapping

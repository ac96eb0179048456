#pragma once
// Registration of a scan to the a priori elevation map.

#include <cstdint>
#include <vector>

#include "modules/registration/registration.h"
#include "modules/registration/voxel_table.h"
#include "modules/sp/prior/prior_points.h"
#include "modules/sp/prior/raster_search.h"
#include "rcs/base/points.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs::sp {

struct PriorMatchParams {
  int max_iterations = 20;
  int min_cells = 12;         ///< map cells with points; fewer: kTooFew
  double robust_sigma = 2.0;  ///< residual, in sigmas, of robust weight 1/4: vegetation above the
                              ///< ground is not in the map
  double gate_sigma = 4.0;    ///< points with larger residuals, in sigmas, are not matched
  /// Largest error of the cells' slopes from the map's own errors: above it, a coarser level of the
  /// map is matched, [0.01, 10]
  double max_slope_noise = 0.1;
  double min_sigma_m = 0.1;  ///< lower bound of the map's sigma
  /// Depth to which light enters vegetation before it returns, sigma; each match estimates it, so
  /// that grass on slopes that face the vehicle does not pull it back
  double foliage_m = 1.0;
  double min_alignment = 0.0005;    ///< observability below which a direction is unobserved
  double max_sigma_m = 2.0;         ///< a direction with a larger sigma is unobserved
  double max_correction_m = 15.0;   ///< larger distance from the prediction: kDiverged
  double max_correction_rad = 0.2;  ///< likewise
  /// Largest inflation of the residuals beyond the map's sigma while the pose is uncertain. It
  /// starts from the prediction's covariance and decays to zero: this widens the convergence region
  /// and makes the result independent of the start
  double max_spread_m = 0.6;
  /// Horizontal standard deviation of a prediction above which the map is searched around it, up to
  /// 1000: never. Real scans with many objects are mostly refused
  double search_sigma_m = 1000.0;
  double step_sigma = 0.05;  ///< converged when a step is smaller, in sigmas
  PriorPointParams points;   ///< of above-ground structure, if the map has surface points
};

struct PriorMatchWorkspace {
  struct Match {
    Elevation ground;
    std::uint32_t* points = nullptr;  ///< in its cell; null: no map data
    double noise = 0.0;               ///< weight times the variance of its gradient
  };
  registration::ScanTable<std::uint32_t> points;  ///< by map cell
  std::vector<Match> matches;
  std::vector<double> differences2;  ///< of the map's gradients, between levels
  PriorPointsWorkspace standing;
  RasterSearchWorkspace search;
};

struct PriorMatch {
  registration::Registration registration;  ///< target: frame world
  std::int64_t tile_id = 0;                 ///< of the tile under the vehicle
  double bias_sigma_m = 0.0;                ///< systematic error of the survey there
  double bias_length_m = 0.0;
};

/// Aligns `source_vehicle` to the map's ground surface: point-to-plane along the map's normals. If
/// the map has surface points, `standing_vehicle` is aligned to them in the same equations.
/// `source_vehicle` must be the lowest points of columns, because above-ground points are not in
/// the map's surface. The points of a cell share the cell's error: their total weight is at most 1
/// / sigma^2, and `information` is bounded likewise; the same holds for voxels of points. The
/// systematic error of the survey is not included: WM estimates it. Deterministic. No allocation
/// once `workspace` has held a scan as large.
[[nodiscard]] PriorMatch match_prior_map(const Points& source_vehicle,
                                         const Points& standing_vehicle, const ElevationMap& map,
                                         const registration::Prediction& prediction,
                                         const PriorMatchParams& params, WorkUnits granted,
                                         PriorMatchWorkspace* workspace);

}  // namespace rcs::sp

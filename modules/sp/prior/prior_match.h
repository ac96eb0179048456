#pragma once
// Registration of a scan to the a priori elevation map.

#include <cstdint>
#include <vector>

#include "modules/registration/registration.h"
#include "modules/registration/voxel_table.h"
#include "modules/sp/prior/prior_points.h"
#include "rcs/base/points.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs::sp {

struct PriorMatchParams {
  int max_iterations = 20;
  int min_cells = 12;         ///< map cells with points; fewer: kTooFew
  double robust_sigma = 2.0;  ///< residual, in sigmas, of robust weight 1/4: what stands on the
                              ///< ground (vegetation) is not in the map
  double gate_sigma = 4.0;    ///< larger residuals, in sigmas, are no match
  /// How steep the map's own errors may make its cells: where they do more, a coarser level of the
  /// map is matched, [0.01, 10]
  double max_slope_noise = 0.1;
  double min_sigma_m = 0.1;  ///< the map is not believed beyond this
  /// How far light goes into vegetation before it returns, sigma: a way that each match finds for
  /// itself, so that grass on slopes that face the vehicle does not pull it back
  double foliage_m = 1.0;
  double min_alignment = 0.0005;    ///< observability below which a direction is unobserved
  double max_sigma_m = 2.0;         ///< a direction known no better than this is unobserved
  double max_correction_m = 15.0;   ///< farther from the prediction: kDiverged
  double max_correction_rad = 0.2;  ///< likewise
  /// Residuals may have so much beyond the map's sigma while the pose is not sure yet, at most;
  /// from what the prediction's covariance says it sinks to nothing, so that the match is found
  /// from afar and its end does not depend on the start
  double max_spread_m = 0.6;
  double step_sigma = 0.05;  ///< converged when a step is smaller, in sigmas
  PriorPointParams points;   ///< of what stands on the ground, where the map has such
};

struct PriorMatchWorkspace {
  struct Match {
    Elevation ground;
    std::uint32_t* points = nullptr;  ///< in its cell; null: the map has nothing there
    double noise = 0.0;               ///< weight, times the variance of its gradient
  };
  registration::ScanTable<std::uint32_t> points;  ///< by map cell
  std::vector<Match> matches;
  std::vector<double> differences2;  ///< of the map's gradients, from level to level
  PriorPointsWorkspace standing;
};

struct PriorMatch {
  registration::Registration registration;  ///< target: frame world
  std::int64_t tile_id = 0;                 ///< of the tile under the vehicle
  double bias_sigma_m = 0.0;                ///< of the survey's slow error there
  double bias_length_m = 0.0;
};

/// Aligns `source_vehicle` to the map's ground surface: point-to-plane along the map's normals.
/// Where the map has surface points, `standing_vehicle` is aligned to them in the same equations.
/// Give it the lowest points of columns: what stands on the ground is not in the map. A cell's
/// points share the cell's error: together they weigh no more than 1 / sigma^2, and `information`
/// is capped likewise; so it is with voxels of points. The survey's slow bias is not in it: WM
/// estimates that. Deterministic. Allocates nothing once `workspace` has seen a scan as large.
[[nodiscard]] PriorMatch match_prior_map(const Points& source_vehicle,
                                         const Points& standing_vehicle, const ElevationMap& map,
                                         const registration::Prediction& prediction,
                                         const PriorMatchParams& params, WorkUnits granted,
                                         PriorMatchWorkspace* workspace);

}  // namespace rcs::sp

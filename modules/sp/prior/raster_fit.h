#pragma once
// Fit of the ground of one scan to an elevation map, in the axes of the map: cost of a candidate
// pose, refinement, and accuracy.

#include <vector>

#include "modules/sp/prior/scan_ground.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs::sp {

struct PriorMatchParams;

/// Candidate pose: the position of the vehicle, the rotation about the vertical from the levelled
/// scan to the map, and the tilt of the levelled scan.
struct RasterPose {
  Vec3 p_map = Vec3::Zero();
  double yaw_rad = 0.0;
  Vec2 tilt = Vec2::Zero();  ///< heights grow by tilt . (point - vehicle), map axes
  double cost = 0.0;         ///< robust
};

struct RasterFit {
  const ElevationMap& map;
  int level;  ///< the finest level of the map to be used
  const PriorMatchParams& params;
  double tilt_sigma_rad;  ///< of the levelled scan against the vertical
  double share;           ///< cells of the scan that share a cell of the map
  /// Edge of a block: errors of the map within one may be correlated in any way, and blocks are
  /// independent.
  double block_m;
};

/// Finds the best height and tilt of a position and heading, and the mean robust cost; infinite if
/// the map has data for fewer than half of the cells.
/// @param spread_m  inflation of the residuals
/// @param residuals  workspace
void evaluate(const RasterFit& fit, const std::vector<ScanGroundCell>& cells, double spread_m,
              std::vector<double>* residuals, RasterPose* pose);

/// Robust Gauss-Newton steps with the slopes of the scan: those of the map contain its errors,
/// which would be correlated with the residuals.
/// @param spread_m  of the first step; it decays to zero
/// @param smallest_m  the last step is smaller
/// @return number of steps, `most` at most
int converge(const RasterFit& fit, const std::vector<ScanGroundCell>& cells, double spread_m,
             int most, double smallest_m, RasterPose* pose);

/// Robust costs by block; a cell without data of the map costs most.
void costs_by_block(const RasterFit& fit, const std::vector<ScanGroundCell>& cells,
                    const RasterPose& pose, std::vector<double>* costs);

/// By how many standard deviations the first candidate fits better than the second: paired
/// differences of blocks (Vuong, 1989).
[[nodiscard]] double advantage(const std::vector<double>& first, const std::vector<double>& second);

struct RasterResiduals {
  int matched = 0;  ///< cells within the gate
  double mean_m = 0.0;
  double rms_m = 0.0;
};
[[nodiscard]] RasterResiduals residuals_of(const RasterFit& fit,
                                           const std::vector<ScanGroundCell>& cells,
                                           const RasterPose& pose);

struct RasterAccuracy {
  /// Of position, height, yaw and tilt in the axes of the map, and of the depth in vegetation.
  Mat<7, 7> covariance = Mat<7, 7>::Zero();
  /// Regression of the map's slopes on the scan's along the weakest horizontal direction, in
  /// standard deviations: small if the slopes of the map are errors.
  double slopes = 0.0;
  bool valid = false;  ///< false: too few blocks, or no information
};

/// Sandwich covariance: the slopes common to scan and map determine the sensitivity, and the sums
/// of the residuals of blocks the scatter; at least that of the sigmas of the cells.
/// @param scores, products  workspaces
[[nodiscard]] RasterAccuracy accuracy_of(const RasterFit& fit,
                                         const std::vector<ScanGroundCell>& cells,
                                         const RasterPose& pose, std::vector<Vec<7>>* scores,
                                         std::vector<double>* products);

}  // namespace rcs::sp

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

struct RasterSteps {
  int taken = 0;
  bool converged = false;
};

/// Robust steps with the slopes of the scan: those of the map contain its errors, which would be
/// correlated with the residuals.
/// @param spread_m  of the first step; it decays to zero
/// @param smallest_m  the last step of a convergence is smaller
RasterSteps converge(const RasterFit& fit, const std::vector<ScanGroundCell>& cells,
                     double spread_m, int max_steps, double smallest_m, RasterPose* pose);

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

/// The contribution of a block of ground to a match.
struct RasterBlock {
  Vec<7> score = Vec<7>::Zero();  ///< sum of weighted residuals times slopes of the scan
  Mat<7, 7> sensitivity = Mat<7, 7>::Zero();
  double product = 0.0;  ///< of the regression of slopes
};

/// Delete-block jackknife: the slopes common to scan and map determine how much the result changes
/// without a block. The covariance is at least that of the sigmas of the cells.
/// @param blocks  workspace
[[nodiscard]] RasterAccuracy accuracy_of(const RasterFit& fit,
                                         const std::vector<ScanGroundCell>& cells,
                                         const RasterPose& pose, std::vector<RasterBlock>* blocks);

}  // namespace rcs::sp

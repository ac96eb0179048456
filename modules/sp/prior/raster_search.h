#pragma once
// Match of a scan to the a priori map from an uncertain prediction: coarse to fine, with the slopes
// of the scan, and refused where the map does not determine one position.

#include <vector>

#include "modules/registration/registration.h"
#include "modules/sp/prior/raster_fit.h"
#include "modules/sp/prior/scan_ground.h"
#include "rcs/terrain/elevation_map.h"

namespace rcs::sp {

struct PriorMatchParams;

struct RasterSearchWorkspace {
  ScanGroundWorkspace scan;
  std::vector<ScanGroundCell> cells;
  std::vector<ScanGroundCell> sample;  ///< some of them, evenly
  std::vector<double> residuals;
  std::vector<RasterPose> hypotheses;
  std::vector<RasterPose> candidates;
  std::vector<double> block_costs;  ///< of the best candidate
  std::vector<double> other_costs;  ///< of another one
  std::vector<RasterBlock> blocks;
};

/// Largest horizontal standard deviation of a prediction [m].
[[nodiscard]] double horizontal_sigma(const registration::Prediction& prediction);

/// Whether the work of a search is granted, and the map is fine enough for one.
[[nodiscard]] bool raster_search_possible(const Points& source_vehicle, const ElevationMap& map,
                                          int level, const registration::Prediction& prediction,
                                          WorkUnits granted);

/// 1. All positions and headings of a lattice that is fixed in the map, within 1.5 sigma of the
///    prediction, are evaluated on some cells of the scan's ground; height and tilt are fitted.
/// 2. The best distinct ones are refined by steps with the slopes of the scan: the slopes of the
/// map
///    contain its errors, and these would be correlated with the residuals. The scan is levelled
///    again with the attitude of the best one, so that the result does not depend on the start.
/// 3. The covariance is the jackknife over blocks of ground, in which the errors of the map may be
///    correlated, but at least that of the sigma that the map states.
/// 4. The match is refused (kDegenerate, with information about the height alone) if it has not
///    converged, if another candidate fits as well, if the slopes of the map are not those of the
///    scan, or if it is less accurate than the prediction.
/// @param level  the finest level of the map to be used
[[nodiscard]] registration::Registration search_raster(const Points& source_vehicle,
                                                       const ElevationMap& map, int level,
                                                       const registration::Prediction& prediction,
                                                       const PriorMatchParams& params,
                                                       RasterSearchWorkspace* workspace);

}  // namespace rcs::sp

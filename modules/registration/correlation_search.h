#pragma once
// Exhaustive search of the pose of one scan relative to another: all headings and positions of a
// region, by the cells that their structure has in common.

#include <vector>

#include "modules/registration/prepared_cloud.h"
#include "rcs/base/pose.h"

namespace rcs::registration {

struct SearchRegion {
  double radius_m = 6.0;   ///< largest error along each horizontal axis, [0, 100]
  double turn_rad = 0.26;  ///< largest error of the heading, [0, pi]
};

struct CorrelationParams {
  double cell_m = 0.4;            ///< [0.05, 5]
  double range_m = 40.0;          ///< structure of the model farther from the region is unused
  double height_m = 8.0;          ///< likewise, above and below it
  double slack_m = 1.2;           ///< [0, 10]
  double turn_step_rad = 0.0175;  ///< [0.001, 0.5]
  int candidates = 5;             ///< returned, [1, 100]
};

struct Hypothesis {
  Pose T_target_vehicle;
  double score = 0.0;  ///< greater is better; its scale depends on who computed it
};

/// Counts, for each heading and position of the region around `base`, the test points of the data
/// that fall in a cell with structure of the model (a correlation of occupancy: the maximum over
/// the region is found whatever the guess is). The cells are extended up and down by slack_m,
/// because the ground rises and falls within the region. Roll and pitch are those of `base`
/// (on_common_ground()); height is that of the model's ground at each result.
/// @return the best that differ by more than two cells or 3.4 deg, the best first, with the share
///   of the test points as score; empty if the model has next to no structure near `base`
/// Cost: about test points x headings x positions / 30 additions. Memory: one byte for each cell
/// within range_m and three times the radius of `base`, 140 MB for a radius of 100 m.
[[nodiscard]] std::vector<Hypothesis> correlate(const PreparedCloud& model,
                                                const PreparedCloud& data, const Pose& base,
                                                const SearchRegion& region,
                                                const CorrelationParams& params);

}  // namespace rcs::registration

#pragma once
// Matches of one scan to an a priori map from random starts around a pose.

#include <cstdint>
#include <functional>
#include <vector>

#include "modules/sp/prior/prior_match.h"
#include "modules/sp/prior/prior_scan.h"

namespace rcs::studies {

struct MatchStarts {
  int starts = 100;
  double max_distance_m = 3.0;  ///< uniform in a disc
  double max_heading_rad = 0.0873;
  std::uint64_t seed = 1;
};

/// The matches of all starts. A start is refused if its match has no horizontal position: it is
/// invalid, or degenerate.
struct MatchEnds {
  static constexpr double kSamePlace_m = 0.1;

  std::vector<Pose> poses;       ///< T_map_vehicle of the matches that are not refused
  std::vector<Mat6> covariance;  ///< of each
  int refused = 0;
  double iterations = 0.0;  ///< mean
  double used = 0.0;        ///< mean work units

  int converged = 0;        ///< ends within kSamePlace_m of their median
  std::size_t nearest = 0;  ///< to the median; none if `poses` is empty

  /// Horizontal covariance of the nearest one, in the axes of the map [m^2].
  [[nodiscard]] Eigen::Matrix2d plane() const;
  /// Whether a horizontal position is inside the 95 % ellipse of the nearest one.
  [[nodiscard]] bool inside(const Vec2& place_m) const;
};

/// @param progress  called with the number of the start
[[nodiscard]] MatchEnds match_from_starts(const sp::PriorScan& scan, const ElevationMap& map,
                                          const Pose& T_map_vehicle, const MatchStarts& starts,
                                          const sp::PriorMatchParams& params,
                                          const std::function<void(int)>& progress);

}  // namespace rcs::studies

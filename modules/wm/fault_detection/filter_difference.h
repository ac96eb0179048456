#pragma once
// Normalized difference of two filters, or of a filter and a fix.

#include "modules/wm/filter.h"

namespace rcs::wm {

/// Covariance of the horizontal position [m^2], world axes.
inline Mat<2, 2> horizontal(const FilterState& s) {
  return s.belief.P.block<2, 2>(kPosition, kPosition);
}

/// Variance along the larger axis of an ellipse.
[[nodiscard]] double largest_variance(const Mat<2, 2>& P);

/// Squared position difference of two filters, normalized by its covariance, which is the
/// difference of their covariances (Hausman 1978).
/// @param less  the filter with less information; @param more  the one with more
/// @param floor_m  standard deviation of errors that are not modelled
[[nodiscard]] double difference(const FilterState& less, const FilterState& more, double floor_m);

/// The same of the heading. A rotated map changes the heading long before the position.
[[nodiscard]] double heading_difference(const FilterState& less, const FilterState& more);

/// The same of the height.
[[nodiscard]] double height_separation(const FilterState& less, const FilterState& more,
                                       double floor_m);

/// The same of roll and pitch.
[[nodiscard]] double tilt_difference(const FilterState& less, const FilterState& more);

/// The difference of two heights, squared, over a bound of its variance that holds for filters with
/// different process models: the sum of the two and of a floor.
[[nodiscard]] double height_difference(const FilterState& a, const FilterState& b, double floor_m);

/// Normalized innovations squared of a fix.
struct Nis {
  double horizontal = 0.0;  ///< 2 dof
  double vertical = 0.0;    ///< 1 dof
  double sigma_m = 0.0;     ///< horizontal standard deviation of the innovation, larger axis
};

/// @param floor_m  standard deviation of errors that are not modelled
[[nodiscard]] Nis nis(const FilterState& s, const GpsFix& z, const GpsParams& params,
                      double floor_m);

}  // namespace rcs::wm

#pragma once
// How far two filters, or a filter and a fix, are apart in units of what they know.

#include "modules/wm/filter.h"

namespace rcs::wm {

/// Covariance of the horizontal position [m^2], world axes.
inline Mat<2, 2> horizontal(const FilterState& s) {
  return s.belief.P.block<2, 2>(kPosition, kPosition);
}

/// Squared difference of two filters in units of its variance (Hausman 1978: what the one knows
/// more than the other is the variance of their difference).
/// @param floor_m  sigma of what the models do not know
[[nodiscard]] double difference(const FilterState& less, const FilterState& more, double floor_m);

/// The same of the heading, which a turned map takes along long before the place.
[[nodiscard]] double heading_difference(const FilterState& less, const FilterState& more);

/// Of a fix, normalized innovations squared.
struct Nis {
  double horizontal = 0.0;  ///< two dof
  double vertical = 0.0;    ///< one
  double sigma_m = 0.0;     ///< horizontal, the larger axis of the innovation
};

/// @param floor_m  sigma of what the model does not know
[[nodiscard]] Nis nis(const FilterState& s, const GpsFix& z, const GpsParams& params,
                      double floor_m);

}  // namespace rcs::wm

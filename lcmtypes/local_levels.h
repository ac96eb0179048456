#pragma once
// Protection levels of the position relative to the rolling map, from WM_NAV_STATE.

#include <algorithm>
#include <cmath>
#include <limits>

#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/base/protection_quantiles.h"

namespace rcs {

/// Infinite: no map, or no valid covariance.
struct LocalLevels {
  double horizontal_m = std::numeric_limits<double>::infinity();
  double vertical_m = std::numeric_limits<double>::infinity();
};

/// While the LADAR is lost or excluded, the covariance relative to the map grows, and so do they.
[[nodiscard]] inline LocalLevels local_levels(const nav_state_t& m) {
  Pose T_rolling_vehicle;
  if (m.rolling_valid == 0 ||
      !from_message(m.q_rolling_vehicle, m.p_rolling_vehicle_m, &T_rolling_vehicle)) {
    return {};
  }
  Mat3 in_vehicle;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) in_vehicle(i, j) = m.cov_rolling_pose[i][j];
  }
  const Mat3 R = T_rolling_vehicle.q.toRotationMatrix();
  const Mat3 in_map = R * in_vehicle * R.transpose();
  const double mean = 0.5 * (in_map(0, 0) + in_map(1, 1));
  const double largest = mean + std::hypot(0.5 * (in_map(0, 0) - in_map(1, 1)), in_map(0, 1));
  // For a new map the covariance is a difference of large and equal matrices (modules/wm/eskf.cpp).
  constexpr double kRounding_m2 = 1e-6;
  const bool good = std::isfinite(largest) && largest > -kRounding_m2 &&
                    std::isfinite(in_map(2, 2)) && in_map(2, 2) > -kRounding_m2;
  if (!good) return {};
  return {kHorizontalQuantile * std::sqrt(std::max(0.0, largest)),
          kVerticalQuantile * std::sqrt(std::max(0.0, in_map(2, 2)))};
}

}  // namespace rcs

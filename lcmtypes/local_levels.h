#pragma once
// Protection levels of the position relative to the rolling map, from WM_NAV_STATE, and the largest
// horizontal variance of a pose.

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

/// Largest variance of the position in a horizontal direction [m^2], from the covariance of a pose
/// in the axes of the vehicle; not finite or negative if that is no covariance.
[[nodiscard]] inline double horizontal_variance(const double (&cov_pose)[6][6],
                                                const Pose& T_frame_vehicle,
                                                double* vertical = nullptr) {
  Mat3 in_vehicle;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) in_vehicle(i, j) = cov_pose[i][j];
  }
  const Mat3 R = T_frame_vehicle.q.toRotationMatrix();
  const Mat3 in_frame = R * in_vehicle * R.transpose();
  if (vertical != nullptr) *vertical = in_frame(2, 2);
  const double mean = 0.5 * (in_frame(0, 0) + in_frame(1, 1));
  return mean + std::hypot(0.5 * (in_frame(0, 0) - in_frame(1, 1)), in_frame(0, 1));
}

/// While the LADAR is lost or excluded, the covariance relative to the map grows, and so do they.
[[nodiscard]] inline LocalLevels local_levels(const nav_state_t& m) {
  Pose T_rolling_vehicle;
  if (m.rolling_valid == 0 ||
      !from_message(m.q_rolling_vehicle, m.p_rolling_vehicle_m, &T_rolling_vehicle)) {
    return {};
  }
  double vertical = 0.0;
  const double largest = horizontal_variance(m.cov_rolling_pose, T_rolling_vehicle, &vertical);
  // For a new map the covariance is a difference of large and equal matrices (modules/wm/eskf.cpp).
  constexpr double kRounding_m2 = 1e-6;
  const bool good = std::isfinite(largest) && largest > -kRounding_m2 && std::isfinite(vertical) &&
                    vertical > -kRounding_m2;
  if (!good) return {};
  return {kHorizontalQuantile * std::sqrt(std::max(0.0, largest)),
          kVerticalQuantile * std::sqrt(std::max(0.0, vertical))};
}

}  // namespace rcs

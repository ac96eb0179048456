#pragma once
// Detects samples of the wheels that repeat the one before: a sensor or driver that is stuck while
// the vehicle moves. WM treats such a sample as if it had not been received. Without an INS a yaw
// rate that stays would turn the filter by degrees a second where the LADAR hardly observes the
// heading.

#include <algorithm>
#include <cmath>

#include "lcmtypes/rcs/odometry_t.hpp"

namespace rcs {

class OdometryContent {
 public:
  /// @param m  in the order of reception
  /// @return whether it is a measurement: not the eighth equal sample in a row of a moving vehicle
  [[nodiscard]] bool add(const odometry_t& m) {
    const bool same = m.utime != last_.utime && m.speed_mps == last_.speed_mps &&
                      (m.yaw_rate_radps == last_.yaw_rate_radps ||
                       (std::isnan(m.yaw_rate_radps) && std::isnan(last_.yaw_rate_radps)));
    repeated_ = same ? repeated_ + 1 : 0;
    if (!same) varied_ = std::min(varied_ + 1, kVaried);
    if (same && varied_ < kVaried) varied_ = 0;
    last_ = m;
    return repeated_ < kStuck || varied_ < kVaried || m.speed_mps == 0.0;
  }

 private:
  // A coarse encoder, or a simulation without noise, repeats its values at a steady speed:
  // repetition counts only after values that have varied for some time. At rest all values are
  // zero.
  static constexpr int kVaried = 40;
  static constexpr int kStuck = 7;

  odometry_t last_{};
  int varied_ = 0;    ///< samples in a row that differed from the one before, until kVaried
  int repeated_ = 0;  ///< in a row
};

}  // namespace rcs

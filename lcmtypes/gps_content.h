#pragma once
// Detects fixes that repeat the position of the one before: a receiver or driver that is stuck, or
// that sends its last solution again, while the vehicle moves. WM treats such a fix as if it had
// not been received. Otherwise a frozen receiver drags the solution back until its fixes are
// rejected, and a fault of another source at the same time excludes the wrong one.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "lcmtypes/rcs/gps_fix_t.hpp"

namespace rcs {

class GpsContent {
 public:
  /// @param m  in the order of reception
  /// @param wheels_mps  newest speed of the wheels, for fixes without velocity; 0: unknown
  /// @return whether it is a measurement: not the same position after the vehicle has moved, by
  ///   half a metre by the velocities of the fixes beyond their noise (a receiver at rest may hold
  ///   its position), or by three by the wheels (which may spin)
  [[nodiscard]] bool add(const gps_fix_t& m, double wheels_mps) {
    const bool same =
        m.lat_deg == last_.lat_deg && m.lon_deg == last_.lon_deg && m.height_m == last_.height_m;
    const double since_s = std::clamp(
        1e-6 * (static_cast<double>(m.utime) - static_cast<double>(last_.utime)), 0.0, kLongest_s);
    moved_m_ = same ? moved_m_ + speed_mps(m) * since_s : 0.0;
    rolled_m_ = same ? rolled_m_ + std::abs(wheels_mps) * since_s : 0.0;
    last_ = m;
    return m.has_velocity == 1 ? !(moved_m_ > kMoved_m) : !(rolled_m_ > kRolled_m);
  }

 private:
  static double speed_mps(const gps_fix_t& m) {
    if (m.has_velocity != 1) return 0.0;
    const double noise_mps = kSigmas * std::hypot(m.sigma_v_enu_mps[0], m.sigma_v_enu_mps[1]);
    const double speed = std::hypot(m.v_enu_mps[0], m.v_enu_mps[1]);
    return speed > std::max(noise_mps, kSlowest_mps) ? speed : 0.0;
  }

  static constexpr double kLongest_s = 2.0;  // between two fixes
  // Above the resolution of NMEA sentences with four decimals of a minute, 0.18 m.
  static constexpr double kMoved_m = 0.5;
  static constexpr double kRolled_m = 3.0;
  static constexpr double kSigmas = 3.0;
  static constexpr double kSlowest_mps = 0.5;

  gps_fix_t last_{};
  double moved_m_ = 0.0, rolled_m_ = 0.0;  ///< since the first fix with this position
};

}  // namespace rcs

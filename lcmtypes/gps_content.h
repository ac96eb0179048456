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
  /// @return whether it is a measurement: not the same position after the vehicle, by the velocity
  ///   of the fix itself, has moved by half a metre
  [[nodiscard]] bool add(const gps_fix_t& m, double wheels_mps) {
    const bool same =
        m.lat_deg == last_.lat_deg && m.lon_deg == last_.lon_deg && m.height_m == last_.height_m;
    const double since_s = 1e-6 * static_cast<double>(m.utime - last_.utime);
    const double speed_mps =
        m.has_velocity == 1 ? std::hypot(m.v_enu_mps[0], m.v_enu_mps[1]) : std::abs(wheels_mps);
    moved_m_ = same ? moved_m_ + speed_mps * std::clamp(since_s, 0.0, kLongest_s) : 0.0;
    last_ = m;
    return !(moved_m_ > kMoved_m);
  }

 private:
  static constexpr double kLongest_s = 2.0;  // between two fixes
  // Above the resolution of NMEA sentences with four decimals of a minute, 0.18 m.
  static constexpr double kMoved_m = 0.5;

  gps_fix_t last_{};
  double moved_m_ = 0.0;  ///< since the first fix with this position
};

}  // namespace rcs

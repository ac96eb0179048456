#pragma once
// The measurements of the synthetic sensors as messages.

#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "tests/wm/synthetic.h"

namespace rcs::wm {

inline ins_t message(const ImuSample& s) {
  ins_t m{};
  m.utime = to_utime(s.stamp);
  m.interval_us = static_cast<std::int32_t>(s.interval.count());
  to_message(s.delta_angle, m.delta_angle_rad);
  to_message(s.delta_v, m.delta_v_mps);
  m.valid = 1;
  return m;
}

inline gps_fix_t message(Stamp stamp, const GeodeticFix& z) {
  gps_fix_t m{};
  m.utime = to_utime(stamp);
  m.lat_deg = degrees(z.antenna.lat_rad);
  m.lon_deg = degrees(z.antenna.lon_rad);
  m.height_m = z.antenna.height.m;
  to_message(z.fix.sigma_m, m.sigma_enu_m);
  m.fix_type = gps_fix_t::FIX_FLOAT;
  return m;
}

inline registration_t message(Stamp stamp, const RollingMatch& z) {
  registration_t m{};
  m.utime = to_utime(stamp);
  m.target = registration_t::TARGET_ROLLING;
  m.map_epoch = z.map_epoch;
  to_message(z.T_rolling_vehicle, m.q_target_vehicle, m.p_target_vehicle_m);
  to_message(z.information, m.information);
  m.stop = z.seeded ? registration_t::STOP_SEEDED : registration_t::STOP_CONVERGED;
  m.latency_trace.measured_utime = m.utime;
  m.latency_trace.last_facet_utime = to_utime(stamp) + 5;
  return m;
}

}  // namespace rcs::wm

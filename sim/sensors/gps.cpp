#include "sim/sensors/gps.h"

#include <algorithm>
#include <cmath>

namespace rcs::sim {

GpsReceiver::GpsReceiver(const GpsParams& params, const Geodetic& datum, std::uint64_t seed)
    : params_(params),
      frame_(datum),
      random_(seed, Stream::kGps),
      slow_(params.sigma_m, params.correlation_s, &random_) {}

bool GpsReceiver::silent_at(double time_s) const {
  return std::any_of(params_.outages.begin(), params_.outages.end(),
                     [time_s](const Outage& outage) { return outage.holds(time_s); });
}

bool GpsReceiver::measure(const Trajectory& vehicle, double time_s, GpsFix* fix) {
  // Noise is drawn during an outage, too, so that an outage does not change what follows it.
  const Vec3 error = slow_.step(params_.interval_s, &random_) + params_.white_m * random_.normal3();
  const Vec3 error_v = params_.sigma_v_mps * random_.normal3();
  const int satellites = 8 + static_cast<int>(3.0 * random_.uniform());
  if (silent_at(time_s)) return false;
  const Motion m = vehicle.at(time_s);
  fix->antenna = frame_.to_geodetic(m.T_world_vehicle * params_.p_vehicle_antenna + error);
  fix->sigma_m = std::hypot(params_.sigma_m, params_.white_m);
  fix->v_world =
      m.v_world + m.T_world_vehicle.q * m.rate_vehicle.cross(params_.p_vehicle_antenna) + error_v;
  fix->sigma_v_mps = params_.sigma_v_mps;
  fix->satellites = satellites;
  fix->hdop = 8.0 / satellites;  // typical of an open sky
  fix->vdop = 1.6 * fix->hdop;
  return true;
}

}  // namespace rcs::sim

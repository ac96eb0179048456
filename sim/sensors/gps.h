#pragma once
// A GPS receiver with a carrier-phase solution with float ambiguities.

#include <vector>

#include "rcs/base/geodesy.h"
#include "sim/base/random.h"
#include "sim/vehicle/trajectory.h"

namespace rcs::sim {

struct Outage {
  double begin_s = 0.0;
  double length_s = 0.0;

  [[nodiscard]] bool holds(double time_s) const {
    return time_s >= begin_s && time_s < begin_s + length_s;
  }
};

struct GpsParams {
  double interval_s = 0.2;
  double latency_s = 0.0;  ///< from validity to arrival
  Vec3 p_vehicle_antenna{-0.5, 0.0, 1.1};
  double sigma_m = 0.3;         ///< time-correlated error (Gauss-Markov), every axis
  double correlation_s = 60.0;  ///< of the time-correlated error
  double white_m = 0.02;
  double sigma_v_mps = 0.05;    ///< white, every axis
  double undulation_m = -33.0;  ///< reported geoid undulation
  std::vector<Outage> outages;  ///< no message within one
  double lost_after_m = 0.0;    ///< distance driven after which no fix is sent any more; 0: never
};

struct GpsFix {
  Geodetic antenna;
  double sigma_m = 0.0;
  Vec3 v_world = Vec3::Zero();  ///< of the antenna
  double sigma_v_mps = 0.0;
  int satellites = 0;
  double hdop = 0.0;
  double vdop = 0.0;
};

class GpsReceiver {
 public:
  GpsReceiver(const GpsParams& params, const Geodetic& datum, std::uint64_t seed);

  [[nodiscard]] const GpsParams& params() const { return params_; }
  /// Whether the time is within an outage.
  [[nodiscard]] bool silent_at(double time_s) const;
  /// The fix for `time_s`; to be called at every interval, in order of time.
  /// @return false within an outage
  [[nodiscard]] bool measure(const Trajectory& vehicle, double time_s, GpsFix* fix);

 private:
  GpsParams params_;
  LocalFrame frame_;
  Random random_;
  GaussMarkov slow_;
};

}  // namespace rcs::sim

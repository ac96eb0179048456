#pragma once
// A light synthetic drive for the filter's laws: ground truth, INS increments, GPS with
// Gauss-Markov errors, registrations to a map that drifts at the vehicle. Seeded; errors as
// modelled by the filter unless configured otherwise (the simulator has other errors).

#include <random>
#include <vector>

#include "modules/wm/estimator.h"
#include "rcs/base/geodesy.h"

namespace rcs::wm {

struct Truth {
  Stamp stamp{};
  Pose T_world_vehicle;
  Vec3 v_world = Vec3::Zero();
  Vec3 rate_vehicle = Vec3::Zero();
};

struct DriveScript {
  double still_s = 4.0;  ///< at the start
  double length_s = 60.0;
  double speed_mps = 8.0;
  double imu_hz = 100.0;
  double heading_rad = 0.7;  ///< at the start
  /// Every five seconds the vehicle pitches over an edge by so much within 0.2 s, and back.
  double edge_rad = 0.0;
  double brake_from_s = 1e9;  ///< from then on straight ahead, at rest two seconds later
};

/// Ground truth at the INS instants: gentle bends, hills, roll.
std::vector<Truth> make_drive(const DriveScript& script);

/// Datum of the drives.
Geodetic test_datum();

struct SensorScript {
  unsigned seed = 1;
  double gps_sigma_m = 0.3;
  double gps_correlated = 0.9;
  double scan_sigma_m = 0.02;
  double scan_sigma_rad = 1e-3;
  double climb_slip = 0.0;  ///< of the wheels, by the sine of the climb
};

/// Sensors over a drive; each call gives the measurement of truth[i].
class Sensors {
 public:
  Sensors(const std::vector<Truth>& truth, const WmParams& params, const SensorScript& script);

  /// Over (truth[i - 1], truth[i]]; call for i = 1, 2, ...
  ImuSample imu(std::size_t i);
  GeodeticFix gps(std::size_t i);
  /// The map drifts between calls by params.drive; the first call seeds it.
  RollingMatch scan(std::size_t i);
  PriorMatch prior(std::size_t i, const Vec3& map_bias);
  OdometrySample odometry(std::size_t i);

 private:
  Vec3 noise(double sigma);
  Vec6 scan_noise();
  Mat6 scan_information() const;

  const std::vector<Truth>& truth_;
  WmParams params_;
  SensorScript script_;
  std::mt19937 random_;
  Earth earth_;
  LocalFrame frame_;
  Vec3 gyro_bias_, accel_bias_, gps_error_;
  std::size_t last_gps_ = 0, last_scan_ = 0;
  Pose T_world_rolling_;
};

}  // namespace rcs::wm

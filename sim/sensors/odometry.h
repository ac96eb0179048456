#pragma once
// Wheel odometry: speed along the vehicle and yaw rate, with slip.

#include "sim/base/random.h"
#include "sim/vehicle/trajectory.h"

namespace rcs::sim {

struct OdometryParams {
  double interval_s = 0.05;
  double scale_error = 0.005;  ///< of the wheel radius; sign by seed
  /// Driven wheels turn faster than the motion over ground by this times the sine of the climb.
  double slip_per_grade = 0.1;
  double sigma_speed_mps = 0.05;
  double sigma_yaw_rate_radps = radians(1.0);
};

struct WheelMotion {
  double speed_mps = 0.0;  ///< mean over the interval, along vehicle x
  double yaw_rate_radps = 0.0;
};

class WheelOdometer {
 public:
  WheelOdometer(const OdometryParams& params, std::uint64_t seed);

  [[nodiscard]] const OdometryParams& params() const { return params_; }
  /// The mean over the interval that ends at `end_s`; to be called in order of time.
  [[nodiscard]] WheelMotion measure(const Trajectory& vehicle, double end_s);

 private:
  OdometryParams params_;
  Random random_;
  double scale_;
};

}  // namespace rcs::sim

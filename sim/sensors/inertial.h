#pragma once
// An inertial measurement unit in the vehicle frame.

#include <string>

#include "rcs/base/geodesy.h"
#include "sim/base/random.h"
#include "sim/vehicle/trajectory.h"

namespace rcs::sim {

/// Errors of a device, one sigma. All zero: a perfect device.
struct InertialGrade {
  double gyro_bias_radps = 0.0;         ///< turn-on bias
  double gyro_instability_radps = 0.0;  ///< in run, first-order Gauss-Markov
  double gyro_walk_radprs = 0.0;        ///< angle random walk [rad/sqrt(s)]
  double accel_bias_mps2 = 0.0;
  double accel_instability_mps2 = 0.0;
  double accel_walk_mpsrs = 0.0;  ///< velocity random walk [m/s/sqrt(s)]
  double correlation_s = 300.0;   ///< of both instabilities
};

struct InertialParams {
  std::string grade_name = "tactical";
  InertialGrade grade;
  double interval_s = 0.01;
  // Uncalibrated errors; signs and axis by seed.
  double scale_error = 300e-6;             ///< of every axis
  double misalignment_rad = radians(0.1);  ///< of the triad
};

/// Gravity and rotation of the earth. Gravity is along -z of frame world everywhere: 1 km from the
/// datum its direction is wrong by 0.16 mrad.
struct Planet {
  double gravity_mps2 = 0.0;
  Vec3 rate_world = Vec3::Zero();  ///< rotation rate of the earth [rad/s]

  [[nodiscard]] static Planet at(const Geodetic& place);
};

struct InertialIncrement {
  Vec3 delta_angle = Vec3::Zero();  ///< integral of the angular rate [rad]
  Vec3 delta_v = Vec3::Zero();      ///< integral of the specific force [m/s]
};

/// Increment of a perfect sensor from `begin_s` to `end_s`: rotation against inertial space and
/// specific force, both in the (rotating) vehicle frame.
[[nodiscard]] InertialIncrement perfect_increment(const Trajectory& vehicle, const Planet& planet,
                                                  double begin_s, double end_s);

class InertialSensor {
 public:
  InertialSensor(const InertialParams& params, const Planet& planet, std::uint64_t seed);

  [[nodiscard]] const InertialParams& params() const { return params_; }
  /// The increment over the interval that ends at `end_s`; to be called in order of time.
  [[nodiscard]] InertialIncrement measure(const Trajectory& vehicle, double end_s);

 private:
  InertialParams params_;
  Planet planet_;
  Random random_;
  Vec3 gyro_bias_;
  Vec3 accel_bias_;
  Mat3 gyro_gain_;  // scale and misalignment
  Mat3 accel_gain_;
  GaussMarkov gyro_drift_;
  GaussMarkov accel_drift_;
};

}  // namespace rcs::sim

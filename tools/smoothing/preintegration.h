#pragma once
// Preintegration of inertial samples: motion between two moments, independent of the initial pose
// and velocity (Lupton and Sukkarieh 2012; Forster et al. 2017, on SO(3)).

#include <vector>

#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"

namespace rcs::smoothing {

/// Increments of one interval, vehicle frame.
struct InertialIncrement {
  Stamp end;
  double interval_s = 0.0;
  Vec3 delta_angle_rad;
  Vec3 delta_v_mps;
};

/// Errors of the sensors: rate = (1 - gyro_scale) * measured - gyro_bias, by axis;
/// force = (1 - accel_gain) * measured - accel_bias.
struct InertialErrors {
  Vec3 gyro_bias_radps = Vec3::Zero();
  Vec3 accel_bias_mps2 = Vec3::Zero();
  Vec3 gyro_scale = Vec3::Zero();
  Mat3 accel_gain = Mat3::Zero();
};

/// Columns of their derivatives: gyro bias, accelerometer bias, gyro scale, gain (row by row).
constexpr int kInertialErrors = 18;
[[nodiscard]] Vec<kInertialErrors> as_vector(const InertialErrors& e);

/// Noise of the samples, white.
struct InertialNoise {
  double angle_random_walk = 4.4e-5;     ///< [rad/sqrt(s)]
  double velocity_random_walk = 1.2e-3;  ///< [m/s/sqrt(s)]
};

/// Rotation and change of velocity and position in the vehicle frame at the begin, without gravity.
/// Errors in the order (phi [rad, on the right of the rotation], v [m/s], p [m]).
struct Preintegrated {
  double dt_s = 0.0;
  Quat turn = Quat::Identity();
  Vec3 dv = Vec3::Zero();
  Vec3 dp = Vec3::Zero();
  Mat<9, kInertialErrors> by_errors = Mat<9, kInertialErrors>::Zero();
  Mat<9> covariance = Mat<9>::Zero();
  InertialErrors errors;  ///< that were corrected
};

/// @param samples  ascending; only their parts between `from` and `to` are used
/// @return dt_s 0 if they have a gap of more than 30 ms or do not cover the whole interval
[[nodiscard]] Preintegrated preintegrate(const std::vector<InertialIncrement>& samples, Stamp from,
                                         Stamp to, const InertialErrors& errors,
                                         const InertialNoise& noise);

}  // namespace rcs::smoothing

#pragma once
// Where a vehicle would think itself to be if it only carried on from one moment, by one kind of
// sensor: what WM's answer without GPS is held against. Pure, but for the reading of a log.

#include <optional>
#include <string>
#include <vector>

#include "rcs/base/geodesy.h"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs::tools {

/// INS, over the interval that ends at `stamp`, in the vehicle frame.
struct InertialSample {
  Stamp stamp;
  Duration interval{};
  Vec3 delta_angle_rad = Vec3::Zero();
  Vec3 delta_v_mps = Vec3::Zero();  ///< of the specific force
};

/// ODOMETRY, likewise; of an instant: since the sample before.
struct WheelSample {
  Stamp stamp;
  Duration interval{};
  double speed_mps = 0.0;       ///< along vehicle x
  double yaw_rate_radps = 0.0;  ///< NaN: not known
};

/// What a log says about the vehicle's own motion. Stamps ascend.
struct RecordedMotion {
  std::vector<InertialSample> inertial;
  std::vector<WheelSample> wheels;
  std::optional<Stamp> begin;     ///< arrival of the first sensor message
  Stamp end;                      ///< of the last one
  std::optional<Geodetic> place;  ///< of the first fix that is one
  bool has_ladar = false;
  bool has_truth = false;
};
[[nodiscard]] Result<RecordedMotion> read_motion(const std::string& log);

/// Where it starts from, and what was known about the sensors by then.
struct ReckoningStart {
  Stamp stamp;
  Pose T_world_vehicle;
  Vec3 v_world = Vec3::Zero();  ///< [m/s]
  Vec3 gyro_bias_radps = Vec3::Zero();
  Vec3 accel_bias_mps2 = Vec3::Zero();
  double wheel_scale = 1.0;  ///< wheels say that times the speed
};

enum class ReckonedBy {
  kGyroAndWheels,     ///< the gyro's turns, the wheels' speed
  kGyroAndLastSpeed,  ///< the gyro's turns, the speed of the start: without wheels
  kWheels,            ///< both by the wheels, where they know the yaw rate
  kInertial           ///< strapdown integration of the INS
};

/// @return T_world_vehicle at `to`; none when the samples leave more than 0.5 s of it uncovered,
/// and
///         for kInertial where the log has no fix: nobody knows gravity
[[nodiscard]] std::optional<Pose> reckon(ReckonedBy by, const ReckoningStart& start,
                                         const RecordedMotion& motion, Stamp to);

}  // namespace rcs::tools

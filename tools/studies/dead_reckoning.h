#pragma once
// Where a vehicle would think itself to be if it only carried on from one moment, by one kind of
// sensor: what WM's answer without GPS is held against. Pure, but for the reading of a log.

#include <optional>
#include <string>
#include <vector>

#include "modules/wm/eskf.h"
#include "rcs/base/geodesy.h"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs::studies {

/// ODOMETRY over (stamp - interval, stamp]; what the log says of an instant speaks for the time
/// since the sample before.
struct WheelSample {
  Stamp stamp;  ///< end of the interval
  Duration interval{};
  double speed_mps = 0.0;       ///< along vehicle x
  double yaw_rate_radps = 0.0;  ///< about vehicle z; NaN: not known
};

/// What a log says about the vehicle's own motion. The samples' stamps are sensor time and ascend;
/// `begin` and `end` are arrivals.
struct RecordedMotion {
  std::vector<wm::ImuSample> inertial;
  std::vector<WheelSample> wheels;
  std::optional<Stamp> begin;     ///< arrival of the first sensor message
  Stamp end;                      ///< of the last one
  std::optional<Geodetic> place;  ///< of the first fix that has one
  bool has_ladar = false;
  bool has_truth = false;
};
/// @param log  path
[[nodiscard]] Result<RecordedMotion> read_motion(const std::string& log);

/// Where it starts from, and what was known about the sensors by then.
struct ReckoningStart {
  Stamp stamp;  ///< sensor time
  Pose T_world_vehicle;
  Vec3 v_world = Vec3::Zero();          ///< [m/s]
  Vec3 gyro_bias_radps = Vec3::Zero();  ///< vehicle axes, to be taken off what the gyro says
  Vec3 accel_bias_mps2 = Vec3::Zero();  ///< likewise, of the accelerometer
  double wheel_scale = 1.0;             ///< of what the wheels say to what is driven
};

enum class ReckonedBy {
  kGyroAndWheels,     ///< the gyro's turns, the wheels' speed
  kGyroAndLastSpeed,  ///< the gyro's turns, the speed of the start: without wheels
  kWheels,            ///< both by the wheels, where they know the yaw rate
  kInertial           ///< strapdown integration of the INS
};

/// Carries on from `start` by the samples between it and `to` alone.
/// @param to  sensor time, not before the start
/// @return T_world_vehicle at `to`. None when the samples leave more than 0.5 s of the way there
///         uncovered; and none for kInertial where the log has no fix: nobody knows gravity.
[[nodiscard]] std::optional<Pose> reckon(ReckonedBy by, const ReckoningStart& start,
                                         const RecordedMotion& motion, Stamp to);

}  // namespace rcs::studies

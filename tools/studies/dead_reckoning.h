#pragma once
// Dead reckoning from one moment by one kind of sensor, for comparison with WM without GPS. Pure,
// except for the reading of a log.

#include <optional>
#include <string>
#include <vector>

#include "modules/wm/eskf.h"
#include "rcs/base/geodesy.h"
#include "rcs/base/pose.h"
#include "rcs/base/result.h"
#include "rcs/base/stamp.h"

namespace rcs::studies {

/// ODOMETRY over (stamp - interval, stamp]; a sample without interval covers the time since the
/// previous sample.
struct WheelSample {
  Stamp stamp;  ///< end of the interval
  Duration interval{};
  double speed_mps = 0.0;       ///< along vehicle x
  double yaw_rate_radps = 0.0;  ///< about vehicle z; NaN: unknown
};

/// The samples of the motion of the vehicle in a log. Their stamps are sensor time and ascend;
/// `begin` and `end` are arrivals.
struct RecordedMotion {
  std::vector<wm::ImuSample> inertial;
  std::vector<WheelSample> wheels;
  std::optional<Stamp> begin;     ///< arrival of the first sensor message
  Stamp end;                      ///< of the last one
  std::optional<Geodetic> place;  ///< of the first fix with a position
  bool has_ladar = false;
  bool has_truth = false;
  std::string damage;  ///< of the log; empty: none
};
/// @param log  path
[[nodiscard]] Result<RecordedMotion> read_motion(const std::string& log);

/// Initial state and calibration of the sensors.
struct ReckoningStart {
  Stamp stamp;  ///< sensor time
  Pose T_world_vehicle;
  Vec3 v_world = Vec3::Zero();          ///< [m/s]
  Vec3 gyro_bias_radps = Vec3::Zero();  ///< vehicle axes, subtracted from the gyro
  Vec3 accel_bias_mps2 = Vec3::Zero();  ///< vehicle axes, subtracted from the accelerometer
  double wheel_scale = 1.0;             ///< measured wheel speed over true speed
};

enum class ReckonedBy {
  kGyroAndWheels,     ///< rotation by the gyro, speed by the wheels
  kGyroAndLastSpeed,  ///< rotation by the gyro, constant initial speed
  kWheels,            ///< both by the wheels, if they measure the yaw rate
  kInertial           ///< strapdown integration of the INS
};

/// Dead reckoning from `start` with only the samples between it and `to`.
/// @param to  sensor time, not before the start
/// @return T_world_vehicle at `to`. nullopt if more than 0.5 s are not covered by samples, and for
///         kInertial if the log has no fix, because gravity is unknown.
[[nodiscard]] std::optional<Pose> reckon(ReckonedBy by, const ReckoningStart& start,
                                         const RecordedMotion& motion, Stamp to);

}  // namespace rcs::studies

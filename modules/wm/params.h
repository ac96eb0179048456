#pragma once
// Parameters of WM: default, unit, meaning. The ranges are in wm_config.cpp.

#include "rcs/base/linear.h"
#include "rcs/base/stamp.h"

namespace rcs::wm {

/// Errors of the INS. Defaults: a tactical-grade unit.
struct ProcessNoise {
  double angle_random_walk = 4.4e-5;     ///< [rad/sqrt(s)] (0.15 deg/sqrt(h))
  double velocity_random_walk = 1.2e-3;  ///< [m/s/sqrt(s)] (0.07 m/s/sqrt(h))
  double gyro_instability = 3.4e-6;      ///< [rad/s] random walk within bias_time_s (0.7 deg/h)
  double accel_instability = 6.9e-4;     ///< [m/s^2] random walk within bias_time_s (0.07 mg)
  double bias_time_s = 300.0;
  double gyro_turn_on = 2.4e-5;   ///< turn-on bias [rad/s] (5 deg/h)
  double accel_turn_on = 9.8e-3;  ///< turn-on bias [m/s^2] (1 mg)
  /// Scale factor (300 ppm) and axis misalignment (0.06 deg). The cross-axis gains of the
  /// accelerometers are estimated (NavState::cross_axis_x, cross_axis_y); the rest is noise in
  /// proportion to the low-passed motion (Lasting).
  double scale_and_misalignment = 1e-3;  ///< [1]
  double motion_time_s = 1.0;            ///< time constant of the low-passed motion
  /// Mounting angles of the INS in the vehicle, about each axis (0.1 deg in all); constant.
  double mount_sigma_rad = 1e-3;
};

/// The vehicle without INS: constant body velocity with white acceleration noise, and body rates
/// that are first-order Gauss-Markov processes. A body on its suspension returns in roll and pitch
/// within tenths of a second; a turn lasts for seconds.
struct MotionNoise {
  double acceleration = 1.5;          ///< [m/s^2/sqrt(Hz)]
  double angular_acceleration = 0.7;  ///< roll and pitch [rad/s^2/sqrt(Hz)]
  double yaw_acceleration = 0.3;      ///< the same about the vertical
  double tilt_time_s = 0.2;           ///< correlation time of the roll and pitch rates
  double yaw_time_s = 3.0;            ///< the same of the yaw rate
  double rate_sigma = 0.05;  ///< smallest sigma of the yaw rate when the INS falls silent [rad/s]
};

/// Noise with the distance driven, the same for both motion models.
struct DriveNoise {
  double rolling_position = 0.008;  ///< drift of the rolling map of SP [m/sqrt(m)]
  double rolling_angle = 2e-4;      ///< the same [rad/sqrt(m)]
  double mount_angle = 1e-6;        ///< random walk of the LADAR misalignment [rad/sqrt(m)]
  /// Stationary sigma of the prior-map bias, if the map states none.
  double map_sigma_m = 1.0;
  double map_length_m = 200.0;      ///< its correlation length
  double wheel_scale = 1e-4;        ///< random walk of the wheel scale [1/sqrt(m)]
  double gps_tau_s = 60.0;          ///< correlation time of the GPS error
  double slip_correlation_s = 0.5;  ///< correlation time of the wheel slip
};

struct GpsParams {
  Vec3 lever_m = Vec3::Zero();  ///< p_vehicle_antenna [m]
  double correlated = 0.9;      ///< share of the reported sigma that is Gauss-Markov
  double sigma_floor_m = 0.01;  ///< smallest sigma with which a fix is fused
  double sigma_time_s = 0.005;  ///< clock of the receiver against that of the vehicle
};

struct RegistrationParams {
  /// Neighbouring residuals of a scan are correlated (same surface, same map), so the information
  /// that SP sums over them is too large. Factor and floor correct this; they are tuned by the NEES
  /// over simulated runs.
  double inflation = 4.0;         ///< of the covariance
  double sigma_floor_m = 0.01;    ///< added on each axis
  double sigma_floor_rad = 5e-4;  ///< added on each axis
  double sigma_time_s = 0.005;    ///< clock of the LADAR against that of the vehicle
  double arm_m = 10.0;            ///< lever arm that converts angles to metres
  double observed_sigma_m = 0.5;  ///< a direction with a larger sigma is unobserved
};

struct MountParams {
  double sigma_rad = 3.5e-3;  ///< of the LADAR misalignment about each axis (0.2 deg)
};

struct RollingParams {
  RegistrationParams match;
  int refused_until_reset = 8;  ///< rejections in a row before a new clone
  /// Share of the covariance of a scan that the rolling map inherits for each metre driven, at most
  /// once a scan [1/m].
  double inherited = 0.2;
  /// Scans closer together see the same points of the ground and share their error.
  double correlation_m = 0.35;
};

struct PriorMapParams {
  /// Rays meet grass the higher the farther away, which tilts a scan against the bare ground: the
  /// tilt is better known from gravity and the rolling map (ADR 49).
  RegistrationParams match{4.0, 0.01, 0.02};
  double mount_sigma_m = 0.01;      ///< of the position of the LADAR mount
  double heading_sigma_rad = 0.01;  ///< largest heading sigma for the first match
  double correlation_m = 10.0;      ///< scans closer together share the errors of the map
  /// Factor on the systematic error that a survey states.
  double bias_margin = 3.0;
  double nis_window_m = 50.0;  ///< distance constant of the low-passed NIS of a tile
};

struct OdometryParams {
  double sigma_floor_mps = 0.05;
  double slip = 0.03;         ///< sigma of the longitudinal slip as a share of the speed
  double lateral_mps = 0.1;   ///< sigma of the lateral velocity at rest
  double vertical_mps = 0.2;  ///< sigma of the vertical velocity at rest, on smooth ground
  double heave_hz = 1.5;      ///< natural frequency of the body on its suspension
  double side_slip = 0.05;    ///< additional sigma of both, as a share of the speed
  double scale_sigma = 0.02;  ///< initial sigma of the wheel scale
  double climb_slip = 0.1;    ///< initial sigma of the slip per sine of the climb
  bool constrained = true;    ///< non-holonomic constraint, also without odometry
  bool zero_velocity =
      true;  ///< zero-velocity updates; false: standstill is used for the alignment only
};

struct StillnessParams {
  double window_s = 0.5;     ///< time constant of the statistics
  double rate_radps = 0.01;  ///< standard deviation below which the vehicle is at rest
  double accel_mps2 = 0.15;  ///< the same of the specific force
  double speed_mps = 0.1;    ///< of the odometry, else of the belief
  double sigma_mps = 0.02;   ///< of the zero-velocity measurement
  Duration period = from_milliseconds(200.0);  ///< between two updates
};

struct AlignParams {
  Duration level_time = from_milliseconds(1000.0);  ///< standstill for levelling
  Duration patience = from_milliseconds(10000.0);   ///< after which it levels in motion
  double level_sigma_mps2 = 0.02;                   ///< of the mean specific force at rest
  double moving_level_sigma_mps2 = 1.0;             ///< the same in motion
  double tilt_sigma_rad = 0.1;                      ///< initial roll and pitch without INS
  double speed_sigma_mps = 15.0;                    ///< initial velocity unless at rest
  double baseline_m = 5.0;                          ///< smallest baseline of fixes for the heading
  double heading_sigma_rad = 0.09;                  ///< largest accepted heading sigma (5 deg)
  double course_speed_mps = 3.0;  ///< above this GPS speed the course initializes the heading
};

struct HistoryParams {
  int capacity = 768;                         ///< inputs kept
  Duration lag = from_milliseconds(1000.0);   ///< age up to which late data is fused
  Duration jump = from_milliseconds(5000.0);  ///< a stamp farther ahead is rejected, >= lag
  Duration bridge =
      from_milliseconds(50.0);  ///< longest gap of the INS that its next sample bridges
  Duration ins_timeout = from_milliseconds(100.0);  ///< after which the INS is silent
  int clock_step_count = 20;  ///< stamps out of range in a row that mean a clock step
};

struct LocalFrameParams {
  double slew_mps = 1.0;    ///< rate limit of LADAR corrections of the local pose
  double slew_radps = 0.2;  ///< the same
};

struct ModeParams {
  Duration gps_timeout = from_milliseconds(3000.0);
  Duration rolling_timeout = from_milliseconds(1000.0);
  /// Silence of all inputs beyond their limits after which the pose is invalid.
  Duration input_timeout = from_milliseconds(300.0);
  double reset_m = 0.5;      ///< a larger step of the world pose is a reset
  double reset_rad = 0.035;  ///< the same
};

/// Fault detection, exclusion and readmission of sources.
struct FaultDetectionParams {
  Duration silence = from_seconds(10.0);      ///< a longer gap of fixes puts GPS in quarantine
  int refused = 5;                            ///< rejected fixes in a row that exclude GPS
  int agreeing = 5;                           ///< of the newest six fixes, for readmission
  Duration agreeing_for = from_seconds(1.0);  ///< duration of the agreement
  /// Fixes that contradict the filter but not each other for this time and distance driven replace
  /// its position.
  Duration persistent = from_seconds(40.0);
  double persistent_m = 100.0;
  Duration probation = from_seconds(5.0);  ///< in which the readmission can be revoked
  Duration branch = from_seconds(10.0);    ///< age at which a sub-filter is branched again
  int refuted_fixes = 5;                   ///< fixes in a row above the test limit that exclude GPS
  Duration ladar_refuted = from_seconds(1.0);  ///< time of matches above it that excludes the LADAR
  int matches = 20;                            ///< accepted matches that readmit the LADAR
  double false_alarm = 1e-6;                   ///< of the sub-filter tests
  double floor_m = 0.3;                        ///< sigma added to the difference of two filters
  /// Sigma of position errors that the covariance of a sub-filter does not contain, per metre
  /// driven.
  double floor_share = 0.003;
  double floor_mps = 0.03;           ///< the same of its velocity
  double attitude_sigma_rad = 0.01;  ///< largest for which sub-filters are branched
  double cusum = 12.0;               ///< limit of the cumulative sum of excess velocity, in sigmas
};

/// Requirements of the mission on the position.
struct IntegrityParams {
  double limit_horizontal_m = 5.0;  ///< alert limits
  double limit_vertical_m = 3.0;
};

struct WmParams {
  ProcessNoise ins;
  MotionNoise motion;
  DriveNoise drive;
  GpsParams gps;
  MountParams mount;
  RollingParams rolling;
  PriorMapParams prior;
  OdometryParams odometry;
  StillnessParams stillness;
  AlignParams align;
  HistoryParams history;
  LocalFrameParams local;
  ModeParams modes;
  FaultDetectionParams fault_detection;
  IntegrityParams integrity;
  double false_alarm = 1e-4;  ///< share of good measurements that a gate rejects
};

}  // namespace rcs::wm

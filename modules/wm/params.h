#pragma once
// Every number that WM's core is tuned by: default, unit, meaning. The ranges are in wm_config.cpp.

#include "rcs/base/linear.h"
#include "rcs/base/stamp.h"

namespace rcs::wm {

/// Errors of the INS. Defaults: a tactical-grade unit.
struct ProcessNoise {
  double angle_random_walk = 4.4e-5;     ///< [rad/sqrt(s)] (0.15 deg/sqrt(h))
  double velocity_random_walk = 1.2e-3;  ///< [m/s/sqrt(s)] (0.07 m/s/sqrt(h))
  double gyro_instability = 3.4e-6;      ///< [rad/s] wandered in bias_time_s (0.7 deg/h)
  double accel_instability = 6.9e-4;     ///< [m/s^2] wandered in bias_time_s (0.07 mg)
  double bias_time_s = 300.0;
  double gyro_turn_on = 2.4e-5;   ///< bias at start [rad/s] (5 deg/h)
  double accel_turn_on = 9.8e-3;  ///< bias at start [m/s^2] (1 mg)
  /// Scale (300 ppm) and crooked axes (0.06 deg). What forces ahead and to the side do to the
  /// accelerometers is estimated (NavState::ahead_gain); the rest, as far as the motion lasts
  /// (Lasting), is noise.
  double scale_and_misalignment = 1e-3;  ///< [1]
  double motion_time_s = 1.0;            ///< what comes and goes faster leaves nothing
  /// Of the INS' axes in the vehicle, about each (0.1 deg in all); for ever the same.
  double mount_sigma_rad = 1e-3;
};

/// The vehicle without INS: constant body velocity, driven by white acceleration, and body rates
/// that are first-order Gauss-Markov processes. A body on its springs rolls and pitches back within
/// tenths of a second; a turn lasts for seconds.
struct MotionNoise {
  double acceleration = 1.5;          ///< [m/s^2/sqrt(Hz)]
  double angular_acceleration = 0.7;  ///< roll and pitch [rad/s^2/sqrt(Hz)]
  double yaw_acceleration = 0.3;      ///< the same about the vertical
  double tilt_time_s = 0.2;           ///< correlation time of the roll and pitch rates
  double yaw_time_s = 3.0;            ///< the same of the yaw rate
  double rate_sigma = 0.05;           ///< of the yaw rate when the INS falls silent [rad/s]
};

/// What changes with the distance driven, whichever model predicts the motion.
struct DriveNoise {
  double rolling_position = 0.008;  ///< drift of SP's map [m/sqrt(m)]
  double rolling_angle = 2e-4;      ///< the same [rad/sqrt(m)]
  double mount_angle = 1e-6;        ///< wander of the LADAR's mount [rad/sqrt(m)]
  /// Of the a priori map's offset, stationary, where the map does not say.
  double map_sigma_m = 1.0;
  double map_length_m = 200.0;      ///< its correlation length
  double wheel_scale = 1e-4;        ///< wander of the wheel's scale [1/sqrt(m)]
  double gps_tau_s = 60.0;          ///< correlation time of the GPS error
  double slip_correlation_s = 0.5;  ///< the same of the wheels' slip
};

struct GpsParams {
  Vec3 lever_m = Vec3::Zero();  ///< p_vehicle_antenna [m]
  double correlated = 0.9;      ///< share of the reported sigma that is Gauss-Markov
  double sigma_floor_m = 0.01;  ///< no fix is believed better than this
  double sigma_time_s = 0.005;  ///< clock of the receiver against ours
};

struct RegistrationParams {
  /// Neighbouring residuals of a scan err together (same surface, same map): the information that
  /// SP sums over them is too good. The factor and the floor say by how much; NEES over simulated
  /// runs is how they are tuned.
  double inflation = 4.0;         ///< of the covariance
  double sigma_floor_m = 0.01;    ///< added, each axis
  double sigma_floor_rad = 5e-4;  ///< added, each axis
  double sigma_time_s = 0.005;    ///< clock of the LADAR against ours
  double arm_m = 10.0;            ///< weighs angles against metres
  double observed_sigma_m = 0.5;  ///< a direction known worse than this is unobserved
};

struct MountParams {
  double sigma_rad = 3.5e-3;  ///< of the LADAR's mount about each axis (0.2 deg)
};

struct RollingParams {
  RegistrationParams match;
  int refused_until_reset = 8;  ///< refusals in a row before a new clone
  /// Share of a scan's covariance that its map inherits for each metre driven, at most once a scan
  /// [1/m].
  double inherited = 0.2;
};

struct PriorMapParams {
  /// Grass that rays meet ever higher with distance tilts a scan against the bare ground: gravity
  /// and the rolling map know better (DECISIONS 49).
  RegistrationParams match{4.0, 0.01, 0.02};
  double mount_sigma_m = 0.01;      ///< of the place of the LADAR's mount
  double heading_sigma_rad = 0.01;  ///< before the first match, at most
  double correlation_m = 10.0;      ///< scans closer than this see the same errors of the map
  /// A survey's slow error is taken for so many times what it says.
  double bias_margin = 3.0;
  double trust_m = 50.0;  ///< of driving in which a tile's trust follows its NIS
};

struct OdometryParams {
  double sigma_floor_mps = 0.05;
  double slip = 0.03;         ///< sigma of slip as a share of the speed
  double lateral_mps = 0.1;   ///< sigma of the side velocity at rest
  double vertical_mps = 0.2;  ///< the same up and down, on smooth ground
  double heave_hz = 1.5;      ///< at which the body sways on its springs
  double side_slip = 0.05;    ///< more of both, as a share of the speed
  double scale_sigma = 0.02;  ///< of the wheel's scale at start
  double climb_slip = 0.1;    ///< of slip by the sine of the climb, at start
  bool constrained = true;    ///< it moves along itself, also where no odometry comes
  bool zero_velocity = true;  ///< fused at standstill; false: that serves the alignment alone
};

struct StillnessParams {
  double window_s = 0.5;                       ///< time constant of the statistics
  double rate_radps = 0.01;                    ///< standard deviation below which it stands
  double accel_mps2 = 0.15;                    ///< the same of the specific force
  double speed_mps = 0.1;                      ///< of odometry, else of the belief
  double sigma_mps = 0.02;                     ///< of the zero-velocity measurement
  Duration period = from_milliseconds(200.0);  ///< between two
};

struct AlignParams {
  Duration level_time = from_milliseconds(1000.0);  ///< stillness to level by
  Duration patience = from_milliseconds(10000.0);   ///< then it levels in motion
  double level_sigma_mps2 = 0.02;                   ///< of the mean specific force at rest
  double moving_level_sigma_mps2 = 1.0;             ///< the same in motion
  double tilt_sigma_rad = 0.1;                      ///< roll and pitch at start without INS
  double speed_sigma_mps = 15.0;                    ///< velocity at start unless it stands
  double baseline_m = 5.0;                          ///< of fixes for the heading, at least
  double heading_sigma_rad = 0.09;                  ///< accept the heading below this (5 deg)
  double course_speed_mps = 3.0;                    ///< a faster GPS velocity is the heading
};

struct HistoryParams {
  int capacity = 768;                         ///< inputs kept
  Duration lag = from_milliseconds(1000.0);   ///< late data is fused within
  Duration jump = from_milliseconds(5000.0);  ///< a stamp further ahead is doubted, >= lag
  Duration bridge =
      from_milliseconds(50.0);  ///< longest gap of the INS that its next sample bridges
  Duration ins_timeout = from_milliseconds(100.0);  ///< then it counts as silent
  int clock_step_count = 20;  ///< stamps out of range in a row: the clock stepped
};

struct LocalFrameParams {
  double slew_mps = 1.0;    ///< LADAR corrections enter the local pose no faster
  double slew_radps = 0.2;  ///< the same
};

struct ModeParams {
  Duration gps_timeout = from_milliseconds(3000.0);
  Duration rolling_timeout = from_milliseconds(1000.0);
  /// All inputs have been silent for so long beyond their limits: the pose is invalid.
  Duration input_timeout = from_milliseconds(300.0);
  double reset_m = 0.5;      ///< a larger step of the world pose is a reset
  double reset_rad = 0.035;  ///< the same
};

/// When a source is believed, when no longer, and when again.
struct TrustParams {
  Duration silence = from_seconds(10.0);  ///< fixes after a longer one are looked at first
  int refused = 5;                        ///< in a row: nothing more of the source is believed
  int agreeing = 5;  ///< of the newest six fixes, so many must agree before it is
  Duration agreeing_for = from_seconds(1.0);   ///< and over this time
  Duration persistent = from_seconds(40.0);    ///< fixes that contradict the belief, but one
  double persistent_m = 100.0;                 ///< another never, for so long and so far driven,
                                               ///< are right
  Duration probation = from_seconds(5.0);      ///< then it can still be undone
  Duration branch = from_seconds(10.0);        ///< age at which a sub-filter is renewed
  int doubted = 5;                             ///< fixes in a row that a sub-filter refutes
  Duration ladar_doubted = from_seconds(1.0);  ///< the same of matches
  int matches = 20;                            ///< that agree bring the LADAR back
  double false_alarm = 1e-6;                   ///< of a sub-filter's test
  double floor_m = 0.3;                        ///< two filters may differ by this
  double floor_share = 0.003;        ///< sigma of the way that a sub-filter does not know of
  double floor_mps = 0.03;           ///< the same of its speed
  double attitude_sigma_rad = 0.01;  ///< of a belief that is worth a sub-filter
  double cusum = 12.0;               ///< of velocities' excess, in sigmas, that refutes fixes
};

/// What the mission needs to know of its place.
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
  TrustParams trust;
  IntegrityParams integrity;
  double false_alarm = 1e-4;  ///< share of good measurements that a gate refuses
};

}  // namespace rcs::wm

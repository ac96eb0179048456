#pragma once
// Every number that WM's core is tuned by: default, unit, meaning, range.

#include "rcs/base/linear.h"
#include "rcs/base/stamp.h"

namespace rcs::wm {

/// Errors of the INS. Defaults: a tactical-grade unit.
struct ProcessNoise {
  double angle_random_walk = 4.4e-5;     ///< [rad/sqrt(s)] (0.15 deg/sqrt(h)), (0, 0.1]
  double velocity_random_walk = 1.2e-3;  ///< [m/s/sqrt(s)] (0.07 m/s/sqrt(h)), (0, 1]
  double gyro_instability = 3.4e-6;      ///< [rad/s] wandered in bias_time_s (0.7 deg/h), (0, 0.1]
  double accel_instability = 6.9e-4;     ///< [m/s^2] wandered in bias_time_s (0.07 mg), (0, 1]
  double bias_time_s = 300.0;            ///< [1, 1e5]
  double gyro_turn_on = 2.4e-5;          ///< bias at start [rad/s] (5 deg/h), (0, 0.1]
  double accel_turn_on = 9.8e-3;         ///< bias at start [m/s^2] (1 mg), (0, 1]
  /// Scale (300 ppm) and crooked axes (0.06 deg). What forces ahead and to the side do to the
  /// accelerometers is estimated (NavState::ahead_gain); the rest, as far as the motion lasts
  /// (Lasting), is noise.
  double scale_and_misalignment = 1e-3;  ///< [1], [0, 0.1]
  double motion_time_s = 1.0;            ///< what comes and goes faster leaves nothing, [0.1, 60]
  /// Of the INS' axes in the vehicle, about each (0.1 deg in all); for ever the same, [0, 10] deg.
  double mount_sigma_rad = 1e-3;
};

/// The vehicle without INS: constant body velocity, driven by white acceleration, and body rates
/// that are first-order Gauss-Markov processes. A body on its springs rolls and pitches back within
/// tenths of a second; a turn lasts for seconds.
struct MotionNoise {
  double acceleration = 1.5;          ///< [m/s^2/sqrt(Hz)], (0, 100]
  double angular_acceleration = 0.7;  ///< roll and pitch [rad/s^2/sqrt(Hz)], (0, 100]
  double yaw_acceleration = 0.3;      ///< the same about the vertical, (0, 100]
  double tilt_time_s = 0.2;           ///< correlation time of the roll and pitch rates, [0.01, 100]
  double yaw_time_s = 3.0;            ///< the same of the yaw rate, [0.01, 100]
  double rate_sigma = 0.05;  ///< of the yaw rate when the INS falls silent [rad/s], (0, 10]
};

/// What changes with the distance driven, whichever model predicts the motion.
struct DriveNoise {
  double rolling_position = 0.008;  ///< drift of SP's map [m/sqrt(m)], [0, 1]
  double rolling_angle = 2e-4;      ///< the same [rad/sqrt(m)], [0, 0.1]
  double mount_angle = 1e-6;        ///< wander of the LADAR's mount [rad/sqrt(m)], [0, 0.01]
  /// Of the a priori map's offset, stationary, where the map does not say, (0, 100].
  double map_sigma_m = 1.0;
  double map_length_m = 200.0;      ///< its correlation length, [1, 1e5]
  double wheel_scale = 1e-4;        ///< wander of the wheel's scale [1/sqrt(m)], [0, 0.1]
  double gps_tau_s = 60.0;          ///< correlation time of the GPS error, [0.1, 1e5]
  double slip_correlation_s = 0.5;  ///< the same of the wheels' slip, [0.01, 1e5]
};

struct GpsParams {
  Vec3 lever_m = Vec3::Zero();  ///< p_vehicle_antenna [m], [-20, 20]
  double correlated = 0.9;      ///< share of the reported sigma that is Gauss-Markov, [0, 1)
  double sigma_floor_m = 0.01;  ///< no fix is believed better than this, (0, 10]
  double sigma_time_s = 0.005;  ///< clock of the receiver against ours, [0, 0.5]
};

struct RegistrationParams {
  /// Neighbouring residuals of a scan err together (same surface, same map): the information that
  /// SP sums over them is too good. The factor and the floor say by how much; NEES over simulated
  /// runs is how they are tuned.
  double inflation = 4.0;         ///< of the covariance, [1, 1000]
  double sigma_floor_m = 0.01;    ///< added, each axis, [0, 1]
  double sigma_floor_rad = 5e-4;  ///< added, each axis, [0, 0.1]
  double sigma_time_s = 0.005;    ///< clock of the LADAR against ours, [0, 0.5]
  double arm_m = 10.0;            ///< weighs angles against metres, [0.1, 100]
  double observed_sigma_m = 0.5;  ///< a direction known worse than this is unobserved, (0, 100]
};

struct MountParams {
  double sigma_rad = 3.5e-3;  ///< of the LADAR's mount about each axis (0.2 deg), [1e-4, 10] deg
};

struct RollingParams {
  RegistrationParams match;
  int refused_until_reset = 8;  ///< refusals in a row before a new clone, [2, 1000]
  /// Share of a scan's covariance that its map inherits for each metre driven, at most once a scan,
  /// [0, 1] 1/m.
  double inherited = 0.2;
};

struct PriorMapParams {
  /// Grass that rays meet ever higher with distance tilts a scan against the bare ground: gravity
  /// and the rolling map know better (DECISIONS 49).
  RegistrationParams match{4.0, 0.01, 0.02};
  double mount_sigma_m = 0.01;      ///< of the place of the LADAR's mount, [0, 1]
  double heading_sigma_rad = 0.01;  ///< before the first match, at most, (0, 3.2]
  double correlation_m = 10.0;  ///< scans closer than this see the same errors of the map, (0, 1e4]
  /// A survey's slow error is taken for so many times what it says, [1, 100].
  double bias_margin = 3.0;
  double trust_m = 50.0;  ///< of driving in which a tile's trust follows its NIS, [1, 1e4]
};

struct OdometryParams {
  double sigma_floor_mps = 0.05;  ///< (0, 10]
  double slip = 0.03;             ///< sigma of slip as a share of the speed, [0, 1]
  double lateral_mps = 0.1;       ///< sigma of the side velocity at rest, (0, 10]
  double vertical_mps = 0.2;      ///< the same up and down, on smooth ground, (0, 10]
  double heave_hz = 1.5;          ///< at which the body sways on its springs, [0.1, 100]
  double side_slip = 0.05;        ///< more of both, as a share of the speed, [0, 1]
  double scale_sigma = 0.02;      ///< of the wheel's scale at start, (0, 0.5]
  double climb_slip = 0.1;        ///< of slip by the sine of the climb, at start, [0, 1]
  bool constrained = true;        ///< it moves along itself, also where no odometry comes
  bool zero_velocity = true;      ///< fused at standstill; false: that serves the alignment alone
};

struct StillnessParams {
  double window_s = 0.5;                       ///< time constant of the statistics, [0.05, 10]
  double rate_radps = 0.01;                    ///< standard deviation below which it stands, (0, 1]
  double accel_mps2 = 0.15;                    ///< the same of the specific force, (0, 10]
  double speed_mps = 0.1;                      ///< of odometry, else of the belief, (0, 10]
  double sigma_mps = 0.02;                     ///< of the zero-velocity measurement, (0, 1]
  Duration period = from_milliseconds(200.0);  ///< between two, [10, 10000] ms
};

struct AlignParams {
  Duration level_time = from_milliseconds(1000.0);  ///< stillness to level by, [100, 60000] ms
  Duration patience = from_milliseconds(10000.0);   ///< then it levels in motion, [100, 600000] ms
  double level_sigma_mps2 = 0.02;                   ///< of the mean specific force at rest, (0, 5]
  double moving_level_sigma_mps2 = 1.0;             ///< the same in motion, (0, 5]
  double tilt_sigma_rad = 0.1;      ///< roll and pitch at start without INS, (0, 0.8]
  double speed_sigma_mps = 15.0;    ///< velocity at start unless it stands, (0, 100]
  double baseline_m = 5.0;          ///< of fixes for the heading, at least, [0.5, 1000]
  double heading_sigma_rad = 0.09;  ///< accept the heading below this (5 deg), (0, 0.5]
  double course_speed_mps = 3.0;    ///< a faster GPS velocity is the heading, [0.5, 100]
};

struct HistoryParams {
  int capacity = 768;                         ///< inputs kept, [64, 100000]
  Duration lag = from_milliseconds(1000.0);   ///< late data is fused within, [10, 10000] ms
  Duration jump = from_milliseconds(5000.0);  ///< a stamp further ahead is doubted, >= lag
  Duration bridge = from_milliseconds(50.0);  ///< gap of the INS that is held over, [1, 1000] ms
  Duration ins_timeout = from_milliseconds(100.0);  ///< then it counts as silent, [10, 10000] ms
  int clock_step_count = 20;  ///< stamps out of range in a row: the clock stepped, [2, 10000]
};

struct LocalFrameParams {
  double slew_mps = 1.0;    ///< LADAR corrections enter the local pose no faster, (0, 10]
  double slew_radps = 0.2;  ///< the same, (0, 10]
};

struct ModeParams {
  Duration gps_timeout = from_milliseconds(3000.0);      ///< [100, 60000] ms
  Duration rolling_timeout = from_milliseconds(1000.0);  ///< [100, 60000] ms
  /// All inputs have been silent for so long beyond their limits: the pose is invalid, [0, 60000]
  /// ms.
  Duration input_timeout = from_milliseconds(300.0);
  double reset_m = 0.5;      ///< a larger step of the world pose is a reset, (0, 100]
  double reset_rad = 0.035;  ///< the same, (0, 3]
};

/// When a source is believed, when no longer, and when again.
struct TrustParams {
  Duration silence = from_seconds(10.0);  ///< fixes after a longer one are looked at first, >= 1 s
  int refused = 5;   ///< in a row: nothing more of the source is believed, [2, 1000]
  int agreeing = 5;  ///< of the newest six fixes, so many must agree before it is, [2, 6]
  Duration agreeing_for = from_seconds(1.0);  ///< and over this time, [0, 60] s
  Duration persistent = from_seconds(40.0);   ///< fixes that contradict the belief, but one
  double persistent_m = 100.0;                ///< another never, for so long and so far driven,
                                              ///< are right, [10, 600] s, [10, 10000]
  Duration probation = from_seconds(5.0);     ///< then it can still be undone, [1, 60] s
  Duration branch = from_seconds(10.0);       ///< age at which a sub-filter is renewed, [2, 60] s
  int doubted = 5;  ///< fixes in a row that a sub-filter refutes, [1, 100]
  Duration ladar_doubted = from_seconds(1.0);  ///< the same of matches, [0.1, 60] s
  int matches = 20;                            ///< that agree bring the LADAR back, [2, 1000]
  double false_alarm = 1e-6;                   ///< of a sub-filter's test, [1e-12, 1e-3]
  double floor_m = 0.3;                        ///< two filters may differ by this, [0.01, 10]
  double floor_share = 0.003;  ///< sigma of the way that a sub-filter does not know of, [0, 0.1]
  double floor_mps = 0.03;     ///< the same of its speed, [0, 1]
  double attitude_sigma_rad = 0.01;  ///< of a belief that is worth a sub-filter, [1e-3, 1]
  double cusum = 12.0;  ///< of velocities' excess, in sigmas, that refutes fixes, [3, 1000]
};

/// What the mission needs to know of its place.
struct IntegrityParams {
  double limit_horizontal_m = 5.0;  ///< alert limits, [0.1, 1000]
  double limit_vertical_m = 3.0;    ///< [0.1, 1000]
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
  double false_alarm = 1e-4;  ///< share of good measurements that a gate refuses, [1e-9, 0.1]
};

}  // namespace rcs::wm

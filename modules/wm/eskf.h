#pragma once
// The error-state Kalman filter: prediction, and the stochastic clone of a map epoch. Pure
// functions of values; nothing allocates.

#include "modules/wm/nav_state.h"
#include "modules/wm/params.h"
#include "rcs/base/geodesy.h"

namespace rcs::wm {

/// Inertial increments over (stamp - interval, stamp], vehicle axes.
struct ImuSample {
  Stamp stamp{};  ///< end of the interval
  Duration interval{};
  Vec3 delta_angle = Vec3::Zero();  ///< [rad]
  Vec3 delta_v = Vec3::Zero();      ///< [m/s], integrated specific force
};

/// Gravity and rotation of the earth at a place.
struct Earth {
  double gravity = 9.80665;        ///< [m/s^2], along -z of world
  Vec3 rate_world = Vec3::Zero();  ///< [rad/s]
};

/// At the datum: normal gravity and the rotation rate of the earth.
[[nodiscard]] Earth earth_at(const Geodetic& datum);

/// Low-passed motion. The error that a scale factor or a misalignment causes at a bump is cancelled
/// by the next one; that of a turn remains. Of the rates only the yaw rate matters: roll and pitch
/// return, and gravity makes them observable.
struct Lasting {
  double yaw_rate = 0.0;      ///< about the z axis of the INS [rad/s]
  Vec3 force = Vec3::Zero();  ///< specific force minus that at rest on level ground [m/s^2]

  void add(const ImuSample& imu, double gravity, double window_s);
};

/// Strapdown integration from b.x.stamp to imu.stamp; the increments must cover exactly that
/// interval. Attitude by the rotation vector, velocity with the first-order rotation term of a
/// constant rate and force (Savage 1998). The second-order coning and sculling terms are omitted:
/// at 100 Hz and more they are far below the random walk.
[[nodiscard]] Belief predict(const Belief& b, const ImuSample& imu, const Earth& earth,
                             const ProcessNoise& noise, const DriveNoise& drive,
                             const Lasting& lasting);

/// The rotation of an INS whose forces are wrong: attitude as above, constant body velocity driven
/// by white acceleration (MotionNoise) as below.
[[nodiscard]] Belief predict_by_rotation(const Belief& b, const ImuSample& imu, const Earth& earth,
                                         const MotionNoise& motion, const ProcessNoise& noise,
                                         const DriveNoise& drive, const Lasting& lasting);

/// Prediction without INS (MotionNoise). The rate is part of the state and is estimated, like the
/// velocity, from all fused measurements; the biases of the INS only wander.
[[nodiscard]] Belief predict(const Belief& b, Stamp to, const MotionNoise& noise,
                             const ProcessNoise& biases, const DriveNoise& drive);

/// The covariance with the noise of the constant-rate model over `time_s` in addition: the vehicle
/// has moved more roughly than the model assumes, by the factor `rougher`.
[[nodiscard]] Belief widen(const Belief& b, double time_s, const MotionNoise& noise,
                           double rougher);

/// The INS has fallen silent: of the body rate only the low-passed yaw rate is kept. The momentary
/// rate of a vehicle that rocks is useless as a prediction.
/// @param sigma_radps  of the rates about the vehicle axes
[[nodiscard]] Belief without_gyro(const Belief& b, double yaw_rate_radps, const Vec3& sigma_radps);

/// Starts a map epoch: T_world_rolling becomes T_world_vehicle * T_rolling_vehicle^-1, a stochastic
/// clone that keeps its correlation with everything the vehicle's pose is correlated with.
/// @param T_rolling_vehicle  at b.x.stamp; exact, because it defines the frame
[[nodiscard]] Belief start_epoch(const Belief& b, const Pose& T_rolling_vehicle, int map_epoch);

/// The same for an epoch that SP began earlier.
/// @param covariance  of the right perturbation of T_rolling_vehicle
[[nodiscard]] Belief start_epoch(const Belief& b, const Pose& T_rolling_vehicle, int map_epoch,
                                 const Mat6& covariance);

/// The rolling map inherits the error of the scan that was added to it at the vehicle.
/// @param covariance  of that error, right perturbation of T_rolling_vehicle
[[nodiscard]] Belief move_map(const Belief& b, const Mat6& covariance);

/// The velocity is known, and it is zero.
[[nodiscard]] bool at_rest(const Belief& b);

/// Adds a shift and a rotation about the vehicle's vertical, common to vehicle and rolling map, to
/// the uncertainty in frame world. The covariance of the vehicle relative to the map is unchanged.
[[nodiscard]] Belief loosen_world(const Belief& b, const Vec3& sigma_world_m, double sigma_yaw_rad);

/// Renews the time-correlated error of GPS but for a share of its old value.
/// @param keep  share of the old value by axis, each in [0, 1]
void renew_gps_offset(const Vec3& keep, Belief* b);

/// Renews the bias of the a priori map: another survey begins here.
void renew_map_offset(double sigma_m, Belief* b);

/// Re-expresses the belief in another level frame world (a rotation about the vertical and a
/// shift).
[[nodiscard]] Belief change_world(const Belief& b, const Pose& T_new_old);

}  // namespace rcs::wm

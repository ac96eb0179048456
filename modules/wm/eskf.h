#pragma once
// The error-state Kalman filter: prediction and the epoch's clone. Pure functions of values;
// nothing allocates.

#include "modules/wm/nav_state.h"
#include "modules/wm/params.h"
#include "rcs/base/geodesy.h"

namespace rcs::wm {

/// Inertial increments over (stamp - interval, stamp], vehicle axes.
struct ImuSample {
  Stamp stamp{};  ///< end of the interval
  Duration interval{};
  Vec3 delta_angle = Vec3::Zero();  ///< [rad]
  Vec3 delta_v = Vec3::Zero();      ///< [m/s], of the specific force
};

/// What the earth does to inertial sensors at a place.
struct Earth {
  double gravity = 9.80665;        ///< [m/s^2], along -z of world
  Vec3 rate_world = Vec3::Zero();  ///< [rad/s]
};

/// At the datum: normal gravity and the earth's rate.
[[nodiscard]] Earth earth_at(const Geodetic& datum);

/// Motion without what comes and goes within seconds: an error of scale or misalignment that a bump
/// causes is taken back by the next one, that of a turn stays. Of the rates only that about the
/// vertical matters: roll and pitch come back to where they were, and gravity tells them.
struct Lasting {
  double yaw_rate = 0.0;      ///< about the INS' z axis [rad/s]
  Vec3 force = Vec3::Zero();  ///< specific force less that at rest on level ground [m/s^2]

  void add(const ImuSample& imu, double gravity, double window_s);
};

/// Strapdown integration from b.x.stamp to imu.stamp; the increments must be those of just that
/// interval. Attitude by the rotation vector, velocity with the first-order rotation term of a
/// constant rate and force (Savage 1998); with one sample at a time the coning and sculling terms
/// of second order are left out: at 100 Hz and more they are far below the random walk.
[[nodiscard]] Belief predict(const Belief& b, const ImuSample& imu, const Earth& earth,
                             const ProcessNoise& noise, const DriveNoise& drive,
                             const Lasting& lasting);

/// Prediction without INS (MotionNoise). The rate is part of the state, estimated like the velocity
/// from whatever is fused; the INS' biases wait.
[[nodiscard]] Belief predict(const Belief& b, Stamp to, const MotionNoise& noise,
                             const ProcessNoise& biases, const DriveNoise& drive);

/// The INS has fallen silent: the body rate is unknown but for what of the motion lasts. The
/// momentary rate of a rocking vehicle is no prediction.
/// @param sigma_radps  of the rates about the vehicle's axes
[[nodiscard]] Belief without_gyro(const Belief& b, double yaw_rate_radps, const Vec3& sigma_radps);

/// Starts a map epoch: T_world_rolling becomes T_world_vehicle * T_rolling_vehicle^-1, a stochastic
/// clone that keeps its correlation with everything the vehicle's pose is correlated with.
/// @param T_rolling_vehicle  at b.x.stamp; exact, because it defines the frame
[[nodiscard]] Belief start_epoch(const Belief& b, const Pose& T_rolling_vehicle, int map_epoch);

/// The same for an epoch that SP has run for a while.
/// @param covariance  of T_rolling_vehicle's right perturbation
[[nodiscard]] Belief start_epoch(const Belief& b, const Pose& T_rolling_vehicle, int map_epoch,
                                 const Mat6& covariance);

/// The map has moved by what was put into it at the vehicle.
/// @param covariance  of that, right perturbation of T_rolling_vehicle
[[nodiscard]] Belief move_map(const Belief& b, const Mat6& covariance);

/// The world slips under vehicle and map alike: adds a common shift and a common turn about the
/// vehicle's vertical to the uncertainty. What they are to each other stays as sure as it was.
[[nodiscard]] Belief loosen_world(const Belief& b, const Vec3& sigma_world_m, double sigma_yaw_rad);

/// The receiver's slow error is another one but for a share, by axis, of what it was.
/// @param keep  each in [0, 1]
void renew_gps_offset(const Vec3& keep, Belief* b);

/// The a priori map is another one here, its slow error too.
void renew_map_offset(double sigma_m, Belief* b);

/// Re-expresses the belief in another level world frame (a turn about the vertical and a shift).
[[nodiscard]] Belief change_world(const Belief& b, const Pose& T_new_old);

}  // namespace rcs::wm

#pragma once
// Measurement models: residuals of each source with their Jacobians and noise.

#include <cstdint>
#include <optional>

#include "modules/wm/kalman_update.h"
#include "modules/wm/nav_state.h"
#include "modules/wm/params.h"

namespace rcs::wm {

/// A fix of the antenna in frame world.
struct GpsFix {
  Vec3 p_world = Vec3::Zero();
  Vec3 sigma_m = Vec3::Ones();  ///< as reported
  Vec3 slow_m = Vec3::Zero();   ///< unit of gps_bias if it differs from sigma_m; 0: it does not
  bool has_velocity = false;
  Vec3 v_world = Vec3::Zero();  ///< of the antenna [m/s]
  Vec3 sigma_v_mps = Vec3::Ones();
};

/// Quality of a fix as reported by the receiver.
struct GpsQuality {
  enum class Fix { kSingle, kDifferential, kFloat, kFixed };
  Fix fix = Fix::kSingle;
  int satellites = 0;  ///< 0: not reported
  double hdop = 0.0;   ///< 0: not reported
  double vdop = 0.0;
};

/// Standard deviation of a fix: not smaller than its kind of solution and the geometry of its
/// satellites allow, whatever the receiver reports.
/// @return sigma_m; none if the fix is unusable (fewer than four satellites)
[[nodiscard]] std::optional<Vec3> worth(const Vec3& claimed_sigma_m, const GpsQuality& quality);

/// A scan registered to the rolling map of SP.
struct RollingMatch {
  Pose T_rolling_vehicle;
  Mat6 information = Mat6::Zero();  ///< right perturbation (rho, phi); zero where unobserved
  int map_epoch = 0;
  bool seeded = false;      ///< the pose defines the frame of a new epoch
  std::int64_t missed = 0;  ///< registrations that SP published since the last one received
  /// Factor of the sigma beyond which a direction is unobserved: that of a LADAR whose errors are
  /// larger than stated is what it was.
  double observed_scale = 1.0;
};

/// Bias of the a priori map: first-order Gauss-Markov in distance, equal in all axes.
struct MapBias {
  double sigma_m = 0.0;  ///< 0: not stated by the map
  double length_m = 0.0;

  friend bool operator==(const MapBias& a, const MapBias& b) {
    return a.sigma_m == b.sigma_m && a.length_m == b.length_m;
  }
  friend bool operator!=(const MapBias& a, const MapBias& b) { return !(a == b); }
};

/// A scan registered to the a priori map.
struct PriorMatch {
  Pose T_world_vehicle;
  Mat6 information = Mat6::Zero();
  std::int64_t tile_id = 0;
  MapBias bias;
};

/// Modelled bias of a survey: its stated systematic error, inflated, or that of the configuration
/// if none is stated.
[[nodiscard]] MapBias modelled_bias(const MapBias& said, const WmParams& params);

/// Wheel speed; the yaw rate is NaN when the source has none.
struct OdometrySample {
  double speed_mps = 0.0;
  double sigma_speed_mps = 1.0;
  double yaw_rate_radps = 0.0;
  double sigma_yaw_rate_radps = 1.0;
};

/// Position of the antenna. A part of the error is white, the rest is the state gps_bias.
[[nodiscard]] Residual<3> gps_position(const NavState& x, const GpsFix& z, const GpsParams& params);

/// The same without its height.
[[nodiscard]] Residual<3> without_height(const Residual<3>& z);

/// Velocity of the antenna. Needs z.has_velocity.
/// @param accel_world  [m/s^2], for the effect of the clock error of the receiver
[[nodiscard]] Residual<3> gps_velocity(const NavState& x, const GpsFix& z, const GpsParams& params,
                                       const Vec3& accel_world);

/// Pose in the rolling map, along the observed directions only: r = log(predicted^-1 * measured).
/// @param weight  share of the information that is new since the last match, (0, 1]
[[nodiscard]] Residual<6> rolling_match(const NavState& x, const RollingMatch& z,
                                        const RegistrationParams& params, double weight);

/// Pose in the a priori map, which is shifted by the prior-map bias.
/// @param weight  share of the information that is new since the last match, (0, 1]
[[nodiscard]] Residual<6> prior_match(const NavState& x, const PriorMatch& z,
                                      const PriorMapParams& params, double weight);

/// Covariance of the error of a scan alone (right perturbation), along its observed directions.
[[nodiscard]] Mat6 observed_covariance(const Mat6& information, const RegistrationParams& params);

/// Covariance of the right perturbation of a registration, with a large sigma along unobserved
/// directions. `unobserved` returns their number.
[[nodiscard]] Mat6 registration_covariance(const NavState& x, const Mat6& information,
                                           const RegistrationParams& params, int* unobserved);

/// Displacement [m], world axes, from the vehicle's position to the one that a registration gives
/// it, in the directions that the registration observes.
[[nodiscard]] Vec3 displacement(const NavState& x, const RollingMatch& z,
                                const RegistrationParams& params);

/// Speed along vehicle x from the wheels, and the yaw rate if no INS is received.
/// @param unknown_tilt_rad  0: the tilt is known. Otherwise its sigma: the slip on a climb is
/// noise,
///   because the product of an unknown slip and an unknown climb determines neither
[[nodiscard]] Residual<2> wheel_speed(const NavState& x, const OdometrySample& z,
                                      const OdometryParams& params, double unknown_tilt_rad = 0.0);

/// Non-holonomic constraint: the velocity along vehicle y and z is near 0.
/// @param shaking_mps2  standard deviation of the specific force, for the sway of the body on rough
///   ground
[[nodiscard]] Residual<2> non_holonomic(const NavState& x, const OdometryParams& params,
                                        double shaking_mps2);

/// Mean specific force [m/s^2, vehicle axes] while the vehicle does not accelerate: observes the
/// vertical, together with the bias of the accelerometers.
[[nodiscard]] Residual<3> level(const NavState& x, const Vec3& specific_force, double gravity,
                                double sigma_mps2);

/// The vehicle is at rest.
[[nodiscard]] Residual<3> zero_velocity(const NavState& x, const StillnessParams& params);

}  // namespace rcs::wm

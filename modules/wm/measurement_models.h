#pragma once
// What each source says about the state: residuals with their Jacobians and noise.

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
  Vec3 slow_m = Vec3::Zero();   ///< unit of gps_offset, if not sigma_m; 0: it is
  bool has_velocity = false;
  Vec3 v_world = Vec3::Zero();  ///< of the antenna [m/s]
  Vec3 sigma_v_mps = Vec3::Ones();
};

/// What else a receiver says of its fix.
struct GpsQuality {
  enum class Fix { kSingle, kDifferential, kFloat, kFixed };
  Fix fix = Fix::kSingle;
  int satellites = 0;  ///< 0: it does not say
  double hdop = 0.0;   ///< 0: it does not say
  double vdop = 0.0;
};

/// What a fix is worth: never better than its kind of solution and the geometry of its satellites
/// allow, whatever the receiver claims.
/// @return sigma_m; nothing when the fix is worth nothing (fewer than four satellites)
[[nodiscard]] std::optional<Vec3> worth(const Vec3& claimed_sigma_m, const GpsQuality& quality);

/// A scan matched to SP's rolling map.
struct RollingMatch {
  Pose T_rolling_vehicle;
  Mat6 information = Mat6::Zero();  ///< right perturbation (rho, phi); zero where unobserved
  int map_epoch = 0;
  bool seeded = false;  ///< the pose defines the frame of a new epoch
};

/// The a priori map's slow error: first-order Gauss-Markov in distance, the same in all axes.
struct MapBias {
  double sigma_m = 0.0;  ///< 0: the map does not say
  double length_m = 0.0;

  friend bool operator==(const MapBias& a, const MapBias& b) {
    return a.sigma_m == b.sigma_m && a.length_m == b.length_m;
  }
  friend bool operator!=(const MapBias& a, const MapBias& b) { return !(a == b); }
};

/// A scan matched to the a priori map.
struct PriorMatch {
  Pose T_world_vehicle;
  Mat6 information = Mat6::Zero();
  std::int64_t tile_id = 0;
  MapBias bias;
};

/// A survey's slow error as it is believed: more than it says, or the configuration's where it does
/// not say.
[[nodiscard]] MapBias believed_bias(const MapBias& said, const WmParams& params);

/// Wheel speed; the yaw rate is NaN when the source has none.
struct OdometrySample {
  double speed_mps = 0.0;
  double sigma_speed_mps = 1.0;
  double yaw_rate_radps = 0.0;
  double sigma_yaw_rate_radps = 1.0;
};

/// Position of the antenna. A part of the error is white, the rest is gps_offset.
[[nodiscard]] Residual<3> gps_position(const NavState& x, const GpsFix& z, const GpsParams& params);

/// The same without its height.
[[nodiscard]] Residual<3> without_height(const Residual<3>& z);

/// Velocity of the antenna. Needs z.has_velocity.
/// @param accel_world  [m/s^2], for what the receiver's clock makes of it
[[nodiscard]] Residual<3> gps_velocity(const NavState& x, const GpsFix& z, const GpsParams& params,
                                       const Vec3& accel_world);

/// Pose in the rolling map, along the observed directions only: r = log(predicted^-1 * measured).
[[nodiscard]] Residual<6> rolling_match(const NavState& x, const RollingMatch& z,
                                        const RegistrationParams& params);

/// Pose in the a priori map, which lies map_offset off.
/// @param weight  share of the information that is new since the last match, (0, 1]
[[nodiscard]] Residual<6> prior_match(const NavState& x, const PriorMatch& z,
                                      const PriorMapParams& params, double weight);

/// Covariance of the scan's own error (right perturbation), along the directions that it observes.
[[nodiscard]] Mat6 observed_covariance(const Mat6& information, const RegistrationParams& params);

/// Covariance of a registration's right perturbation; a large sigma along unobserved directions.
/// `unobserved` tells how many there are.
[[nodiscard]] Mat6 registration_covariance(const NavState& x, const Mat6& information,
                                           const RegistrationParams& params, int* unobserved);

/// Speed along vehicle x by the wheels, and the yaw rate where no INS gives it.
[[nodiscard]] Residual<2> wheel_speed(const NavState& x, const OdometrySample& z,
                                      const OdometryParams& params);

/// Wheels neither jump nor skid much: velocity along vehicle y and z is near 0.
/// @param shaking_mps2  standard deviation of the specific force: how much the ground makes it sway
[[nodiscard]] Residual<2> non_holonomic(const NavState& x, const OdometryParams& params,
                                        double shaking_mps2);

/// Mean specific force [m/s^2, vehicle axes] while the vehicle does not accelerate: which way is
/// up, together with the accelerometers' bias.
[[nodiscard]] Residual<3> level(const NavState& x, const Vec3& specific_force, double gravity,
                                double sigma_mps2);

/// The vehicle stands.
[[nodiscard]] Residual<3> zero_velocity(const NavState& x, const StillnessParams& params);

}  // namespace rcs::wm

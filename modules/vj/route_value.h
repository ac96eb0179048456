#pragma once
// Value judgment of routes: risk and cost from what the world model predicts along them.

namespace rcs::vj {

/// What is known of a route before it is driven.
struct RouteForecast {
  double length_m = 0.0;
  double time_s = 0.0;
  /// Largest standard deviation of the position along it, worst direction, if GPS fails at its
  /// start; infinite: no prediction.
  double sigma_m = 0.0;
};

struct RouteLimits {
  double alert_limit_m = 5.0;           ///< of the horizontal protection level, by the task
  double gps_loss_probability = 0.1;    ///< of the drive; 1: GPS is lost
  double cost_of_exceedance_s = 600.0;  ///< a vehicle that stands at its alert limit, in seconds
  /// Part of the protection level beyond that of the standard deviation: faults that may not have
  /// been detected.
  double undetected_m = 0.0;
};

struct RouteValue {
  double level_m = 0.0;  ///< largest horizontal protection level, if GPS fails
  double risk = 0.0;     ///< of a position error above the alert limit, if GPS fails: [0, 1]
  double cost_s = 0.0;   ///< time, and the risk in seconds
  bool keeps_limit = false;
};

/// The error is isotropic with the standard deviation of the worst direction, so that its length is
/// Rayleigh distributed: an upper bound of the risk.
[[nodiscard]] RouteValue value_of(const RouteForecast& route, const RouteLimits& limits);

}  // namespace rcs::vj

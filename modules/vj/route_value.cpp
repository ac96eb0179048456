#include "modules/vj/route_value.h"

#include <cmath>

#include "rcs/base/protection_quantiles.h"

namespace rcs::vj {

RouteValue value_of(const RouteForecast& route, const RouteLimits& limits) {
  RouteValue v;
  v.level_m = kHorizontalQuantile * route.sigma_m + limits.undetected_m;
  const double ratio = limits.alert_limit_m / route.sigma_m;
  v.risk = route.sigma_m > 0.0 ? std::exp(-0.5 * ratio * ratio) : 0.0;
  v.keeps_limit = v.level_m <= limits.alert_limit_m;
  // What counts is whether the vehicle has to stop on the way: the level, and not the error.
  const double exceeds = v.keeps_limit ? v.risk : 1.0;
  v.cost_s = route.time_s + limits.gps_loss_probability * exceeds * limits.cost_of_exceedance_s;
  return v;
}

}  // namespace rcs::vj

#include "modules/vj/traversal_cost.h"

#include <algorithm>
#include <cmath>

namespace rcs::vj {
namespace {

// Difficulty of ground, from easy (0) to the limit of what is driven (1).
double hardness(const Ground& g, const Weights& w) {
  return std::clamp(std::max(g.slope_rad / w.max_slope_rad, g.roughness_m / w.max_roughness_m), 0.0,
                    1.0);
}

double nearness(double clearance_m, const Weights& w) {
  return std::clamp(1.0 - clearance_m / w.near_m, 0.0, 1.0);
}

}  // namespace

bool passable(const Ground& g, const Weights& w) {
  return !g.known || (!g.obstacle && g.slope_rad <= w.max_slope_rad);
}

double roll_on(const Ground& g, double heading_rad) {
  return std::atan(-std::sin(heading_rad) * g.rise_x + std::cos(heading_rad) * g.rise_y);
}

double cost_of_roll(double roll_rad, const Weights& w) {
  const double share = std::min(1.0, std::abs(roll_rad) / w.max_roll_rad);
  return w.roll * share * share;
}

double cost_per_m(const Ground& g, double clearance_m, const Weights& w) {
  const double near = nearness(clearance_m, w);
  const double cost = 1.0 + w.nearness * near * near +
                      (clearance_m < w.margin_m ? w.within_margin : 0.0) +
                      w.off_route * g.off_route_m;
  if (!g.known) return cost + w.unknown;
  const double slope = std::min(1.0, g.slope_rad / w.max_slope_rad);
  const double rough = std::min(1.0, g.roughness_m / w.max_roughness_m);
  const double step = std::min(1.0, g.step_m / w.max_step_m);
  return cost + (g.vegetation ? w.vegetation : 0.0) + w.slope * slope * slope +
         w.roughness * rough * rough + w.step * step * step;
}

SpeedLimit speed_on(const Ground& g, double clearance_m, const Weights& w, const SpeedParams& p) {
  SpeedLimit limit{p.unknown_mps, SpeedCause::kUnknown};
  if (g.known) {
    limit = {p.smooth_mps + hardness(g, w) * (p.rough_mps - p.smooth_mps), SpeedCause::kGround};
  }
  if (g.vegetation) limit.lower_to(p.vegetation_mps, SpeedCause::kVegetation);
  limit.lower_to(p.smooth_mps + nearness(clearance_m, w) * (p.near_mps - p.smooth_mps),
                 SpeedCause::kClearance);
  return limit;
}

double speed_in_turn(double curvature_1pm, const SpeedParams& p) {
  const double curvature = std::abs(curvature_1pm);
  return curvature * p.smooth_mps * p.smooth_mps <= p.lateral_mps2
             ? p.smooth_mps
             : std::sqrt(p.lateral_mps2 / curvature);
}

namespace {

/// 1 up to `full`, falling to `least` at `limit`, then 0; NaN counts as beyond the limit.
double falling_share(double value, double full, double limit, double least) {
  if (!(value < limit)) return 0.0;
  if (value <= full) return 1.0;
  return 1.0 + (value - full) / (limit - full) * (least - 1.0);
}

}  // namespace

double speed_share(double sigma_m, const SpeedParams& p) {
  return falling_share(sigma_m, p.full_speed_sigma_m, p.stop_sigma_m, p.min_speed_share);
}

double protected_share(double horizontal_m, double vertical_m, const SpeedParams& p) {
  const auto share = [&p](double level_m, double limit_m) {
    return falling_share(level_m, 0.5 * limit_m, limit_m, p.min_speed_share);
  };
  return std::min(share(horizontal_m, p.alert_limit_horizontal_m),
                  share(vertical_m, p.alert_limit_vertical_m));
}

}  // namespace rcs::vj

#include "modules/bg/path_follow.h"

#include <algorithm>
#include <cmath>

namespace rcs::bg {
namespace {

double distance(const Pose2d& a, const Pose2d& b) {
  return std::hypot(a.x_m - b.x_m, a.y_m - b.y_m);
}

// One past the last point that is driven in the direction of point `at`.
std::size_t end_of_leg(const Path& path, std::size_t at) {
  // The first point has no direction of its own.
  const int direction = path[std::max<std::size_t>(at, 1)].direction;
  std::size_t end = std::max<std::size_t>(at, 1);
  while (end < path.size() && path[end].direction == direction) ++end;
  return end;
}

// Length of path over which a change of curvature is limited: a single step between arcs of the
// search is soon compensated, a sequence of steps is not.
constexpr double kWindow_m = 2.4;
// Square of the speed [m2/s2] at which the vehicle stops within a few centimetres anyway.
constexpr double kCreep2 = 0.25;

// Of a command, also where the path is narrower than the speed allows: the vehicle rather leaves
// it.
constexpr double kLateral_mps2 = 3.0;

// Limits the speed to what the steering rate can follow.
void limit_turning(const Shape& shape, Path* path) {
  std::size_t from = 0;
  for (std::size_t k = 1; k < path->size(); ++k) {
    while ((*path)[k].s_m - (*path)[from].s_m > kWindow_m) ++from;
    const double change =
        std::abs((*path)[k].place.curvature_1pm - (*path)[from].place.curvature_1pm);
    if (change * 1e3 < shape.curvature_rate) continue;
    const double limit_mps = shape.curvature_rate * kWindow_m / change;
    for (std::size_t n = from; n <= k; ++n) {
      if (limit_mps >= (*path)[n].limit_mps) continue;
      (*path)[n].limit_mps = limit_mps;
      (*path)[n].cause = vj::SpeedCause::kSteering;
    }
  }
}

}  // namespace

double stopping_m(double speed_mps, const FollowParams& params) {
  const double v_mps = std::abs(speed_mps);
  return v_mps * (params.latency_s + 0.5 * v_mps / params.braking_mps2);
}

double speed_within(double free_m, double speed_mps, const FollowParams& params) {
  const double way_m = free_m - params.latency_s * std::abs(speed_mps);
  return std::sqrt(2.0 * params.braking_mps2 * std::max(0.0, way_m));
}

bool must_brake(double free_m, double speed_mps, const FollowParams& params) {
  const double way_m = free_m - params.latency_s * std::abs(speed_mps);
  return speed_mps * speed_mps > 2.0 * params.firm_mps2 * std::max(0.0, way_m) + kCreep2;
}

void plan_speeds(const vj::Terrain& terrain, const vj::Weights& weights,
                 const vj::SpeedParams& speeds, const FollowParams& params, const Shape& shape,
                 double max_mps, double share, Path* path) {
  for (PathPoint& p : *path) {
    vj::SpeedLimit limit{max_mps, vj::SpeedCause::kTask};
    limit.lower_to(vj::speed_in_turn(p.place.curvature_1pm, speeds), vj::SpeedCause::kTurn);
    for (const double ahead_m : {-0.4 * shape.length_m, 0.0, 0.4 * shape.length_m}) {
      const Cell cell = terrain.cell_at(p.place.x_m + ahead_m * std::cos(p.place.heading_rad),
                                        p.place.y_m + ahead_m * std::sin(p.place.heading_rad));
      const vj::SpeedLimit on = vj::speed_on(terrain.at(cell), p.clearance_m, weights, speeds);
      limit.lower_to(on.mps, on.cause);
    }
    if (p.direction < 0) limit.lower_to(speeds.near_mps, vj::SpeedCause::kReverse);
    if (share < 1.0) limit = {share * limit.mps, vj::SpeedCause::kUncertainty};
    limit.lower_to(p.zone_mps, vj::SpeedCause::kZone);
    limit.lower_to(std::max(speeds.sight_mps, p.road_mps), vj::SpeedCause::kSight);
    p.limit_mps = limit.mps;
    p.cause = limit.cause;
  }
  limit_turning(shape, path);
  double braked = 0.0;
  vj::SpeedCause cause = vj::SpeedCause::kEnd;  // of braked
  for (std::size_t k = path->size(); k-- > 0;) {
    PathPoint& p = (*path)[k];
    if (k + 1 < path->size()) {
      const PathPoint& next = (*path)[k + 1];
      const bool turns_back = k > 0 && next.direction != p.direction;
      const double way_m = next.s_m - p.s_m;
      braked = turns_back ? 0.0 : std::sqrt(braked * braked + 2.0 * params.braking_mps2 * way_m);
      if (turns_back) cause = vj::SpeedCause::kEnd;
    }
    if (p.limit_mps < braked) {
      braked = p.limit_mps;
      cause = p.cause;
    }
    p.speed_mps = braked;
    p.cause = cause;
  }
}

Steering follow(const Path& path, const Pose2d& vehicle, double speed_mps,
                const FollowParams& params, const Shape& shape, std::size_t* at) {
  Steering out;
  if (path.size() < 2) {
    out.at_end = true;
    return out;
  }
  // The nearest point of this leg, from the last position on.
  std::size_t end = end_of_leg(path, *at);
  double nearest = distance(path[*at].place, vehicle);
  for (std::size_t k = *at + 1; k < end; ++k) {
    const double d = distance(path[k].place, vehicle);
    if (d > nearest + 2.0) break;
    if (d <= nearest) {
      nearest = d;
      *at = k;
    }
  }
  // At its end, and slow enough: continues with the next leg.
  const double left_m = path[end - 1].s_m - path[*at].s_m;
  if (end < path.size() && left_m < 0.3 && std::abs(speed_mps) < 0.2) {
    *at = end;
    end = end_of_leg(path, *at);
  }
  const int direction = path[std::max<std::size_t>(*at, 1)].direction;
  const double c = std::cos(path[*at].place.heading_rad);
  const double s = std::sin(path[*at].place.heading_rad);
  out.off_m = c * (vehicle.y_m - path[*at].place.y_m) - s * (vehicle.x_m - path[*at].place.x_m);
  out.at_end = end == path.size() && path[end - 1].s_m - path[*at].s_m < 0.3;

  const double ahead_m = std::max(params.lookahead_min_m, params.lookahead_s * std::abs(speed_mps));
  std::size_t target = *at;
  while (target + 1 < end && path[target].s_m - path[*at].s_m < ahead_m) ++target;
  Pose2d aim = path[target].place;
  // Beyond the end of the leg it is extended straight, so that the steering is steady at the end.
  const double missing_m = ahead_m - (path[target].s_m - path[*at].s_m);
  if (missing_m > 0.0) {
    aim.curvature_1pm = 0.0;
    aim = along_arc(aim, direction * missing_m);
  }
  const double hc = std::cos(vehicle.heading_rad);
  const double hs = std::sin(vehicle.heading_rad);
  const double dx = aim.x_m - vehicle.x_m;
  const double dy = aim.y_m - vehicle.y_m;
  const double left = hc * dy - hs * dx;
  const double d2 = std::max(0.01, dx * dx + dy * dy);
  const double most_1pm =
      std::min(shape.max_curvature_1pm, kLateral_mps2 / std::max(0.01, speed_mps * speed_mps));
  out.curvature_1pm = std::clamp(2.0 * left / d2, -most_1pm, most_1pm);

  // Speed limit from now until the steering takes effect.
  const double until_m = path[*at].s_m + params.latency_s * std::abs(speed_mps);
  double planned = path[*at].speed_mps;
  // A path that starts at rest must allow the first metre.
  if (*at + 1 < end) planned = std::max(planned, 0.3);
  for (std::size_t k = *at; k < end && path[k].s_m <= until_m; ++k) {
    if (k > *at) planned = std::min(planned, std::max(path[k].speed_mps, 0.0));
  }
  out.speed_mps = out.at_end ? 0.0 : direction * planned;
  return out;
}

double free_way(const Body& body, const ObstacleDistance& obstacles, const Path& path,
                std::size_t at, const Pose2d& vehicle, double speed_mps, int direction,
                const FollowParams& params, const Shape& shape, double required_m, double max_m) {
  constexpr double kStep_m = 0.2;
  constexpr double kSlowest_mps = 0.3;  // a vehicle that starts turns its wheels first
  Pose2d p = vehicle;
  double speed = std::abs(speed_mps);
  const double late_m = params.latency_s * speed;
  for (double way_m = 0.0; way_m < max_m; way_m += kStep_m) {
    const Steering steering = follow(path, p, direction * speed, params, shape, &at);
    const double turn = shape.curvature_rate * kStep_m / std::max(kSlowest_mps, speed);
    // Until then the wheels stay as they are: commands take effect late.
    if (way_m >= late_m) {
      p.curvature_1pm += std::clamp(steering.curvature_1pm - p.curvature_1pm, -turn, turn);
    }
    p = along_arc(p, direction * kStep_m);
    if (body.clearance(obstacles, p) < required_m) return way_m;
    // Where the path is slower than now the vehicle can turn faster.
    const double braked2 = speed * speed - 2.0 * params.braking_mps2 * kStep_m;
    const double slower = std::max(std::abs(steering.speed_mps), std::sqrt(std::max(0.0, braked2)));
    speed = std::max(kSlowest_mps, std::min(speed, slower));
  }
  return max_m;
}

}  // namespace rcs::bg

#include "modules/bg/local_route_node.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/convert.h"

namespace rcs::bg {
namespace {

constexpr double kAhead_m = 12.0;         // of the goal on a way back
constexpr std::size_t kPlacesAhead = 16;  // of a way back, that may be left out
constexpr std::size_t kPlacesBehind = 4;

bool is_at(const Goal& g, const Pose2d& p) {
  return std::hypot(g.x_m - p.x_m, g.y_m - p.y_m) <= g.radius_m;
}

}  // namespace

void LocalRoute::begin() {
  datum_.reset();
  other_world_ = false;
  ahead_.reset();
}

void LocalRoute::note_datum(const Nav& nav) {
  if (!nav.world_valid || !route_.in_world()) return;
  if (!datum_) datum_ = nav.datum;
  other_world_ = other_world_ || *datum_ != nav.datum;
}

bool LocalRoute::in_other_map(const Nav& nav) const {
  return route_.map_epoch() && nav.arrival != Stamp::min() && nav.map_epoch != *route_.map_epoch();
}

Goal LocalRoute::goal(const Nav& nav, const Pose2d& vehicle) {
  if (!knows_north(nav)) {
    if (!ahead_) {
      const Pose2d end = along_arc({vehicle.x_m, vehicle.y_m, vehicle.heading_rad, 0.0}, north_m_);
      ahead_ = Goal{end.x_m, end.y_m, 3.0};
    }
    return *ahead_;
  }
  if (!route_.map_epoch()) return goal_of(route_.next(), nav);
  return goal_of(route_.waypoint(route_.ahead(next(), kAhead_m)), nav);
}

std::optional<Goal> LocalRoute::onward_goal(const Nav& nav) const {
  if (route_.map_epoch()) {
    const std::size_t to = route_.ahead(next(), kAhead_m);
    const std::size_t onward = route_.ahead(to, kAhead_m);
    if (onward == to) return std::nullopt;
    return goal_of(route_.waypoint(onward), nav);
  }
  const waypoint_t* const after = route_.after_next();
  if (!knows_north(nav) || after == nullptr) return std::nullopt;
  return goal_of(*after, nav);
}

Goal LocalRoute::goal_of(const waypoint_t& w, const Nav& nav) const {
  Vec3 p = from_message(w.p_m);
  if (route_.in_world()) {
    p = nav.T_local_vehicle * (nav.T_world_vehicle.inverse() * p);
  } else if (route_.map_epoch()) {
    p = nav.T_local_vehicle * (nav.T_rolling_vehicle.inverse() * p);
  }
  // The radius is reduced by the uncertainty, so that the vehicle is really within the circle.
  const double sigma_m = route_.in_world() ? nav.sigma_world_m : 0.0;
  return {p.x(), p.y(), std::max(0.5 * w.radius_m, w.radius_m - 2.0 * sigma_m)};
}

void LocalRoute::pass(const Nav& nav, const Pose2d& vehicle) {
  if (nav.arrival == Stamp::min() || !knows_north(nav) || other_world_ || in_other_map(nav)) return;
  if (!route_.map_epoch()) {
    while (!route_.arrived() && is_at(goal(nav, vehicle), vehicle)) route_.pass();
    return;
  }
  // Of a way back, places that an obstacle has made the vehicle leave out are done, too.
  const std::size_t last = std::min(static_cast<std::size_t>(route_.size()), next() + kPlacesAhead);
  for (std::size_t k = last; k-- > next();) {
    if (!is_at(goal_of(route_.waypoint(k), nav), vehicle)) continue;
    route_.pass_to(k + 1);
    return;
  }
}

void LocalRoute::way_back(const Nav& nav, double ahead_m, std::vector<Vec2>* places) const {
  places->clear();
  if (!route_.map_epoch() || route_.arrived() || in_other_map(nav)) return;
  const std::size_t from = next() > kPlacesBehind ? next() - kPlacesBehind : 0;
  const std::size_t to = route_.ahead(next(), ahead_m + kAhead_m);
  for (std::size_t k = from; k <= to; ++k) {
    const Goal g = goal_of(route_.waypoint(k), nav);
    places->emplace_back(g.x_m, g.y_m);
  }
}

bool LocalRoute::ends_at(const Pose2d& place, const Nav& nav) const {
  return is_at(goal_of(route_.waypoint(static_cast<std::size_t>(route_.size()) - 1), nav), place);
}

}  // namespace rcs::bg

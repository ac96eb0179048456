#include "modules/bg/planner.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "modules/bg/path_smoothing.h"

namespace rcs::bg {
namespace {

constexpr Duration kRefresh = from_seconds(1.0);  // interval, for the same goal
constexpr double kSameGoal_m = 0.5;
constexpr double kThrough = 0.6;  // of the radius of a goal that is driven through
constexpr double kNearer_m = 1.0;

}  // namespace

Planner::Planner(const SearchParams& params, const Shape& shape, const vj::Weights& weights,
                 double near_goal_m)
    : shape_(shape),
      weights_(weights),
      near_goal_m_(near_goal_m),
      search_(params, shape, weights) {}

bool Planner::Beyond::is_of(const Goal& other) const {
  return goal && std::hypot(goal->x_m - other.x_m, goal->y_m - other.y_m) < kSameGoal_m &&
         std::abs(goal->radius_m - other.radius_m) < kSameGoal_m;
}

bool Planner::Beyond::is_due(const Goal& other, Stamp now) const {
  return !is_of(other) || now - computed >= kRefresh;
}

SearchResult Planner::plan(const Query& query, Stamp now, int granted, Path* path) {
  update_cost(query, now);
  update_onward_cost(query, now);
  if (through_) {
    onward_field_.compute(query.terrain, query.obstacles, onward_.cost, *query.onward, weights_,
                          search_.body().radius_m(), query.start.required_m);
  }
  SearchResult found;
  int expansions = 0;
  for (double more_m = more_m_;; more_m = near_goal_m_) {
    through_ = through_ &&
               more_m == 0.0;  // otherwise the goal is occupied or hidden: it is observed first
    // A path through the goal must not only touch its circle: the vehicle deviates from it.
    const double radius_m = (through_ ? kThrough : 1.0) * (query.to.radius_m + more_m);
    const Goal to{query.to.x_m, query.to.y_m, radius_m};
    field_.compute(query.terrain, query.obstacles, to_.cost, to, weights_,
                   search_.body().radius_m(), query.start.required_m);
    found = search_.search(query.terrain, query.obstacles, query.start, {to, &field_},
                           onward_target(), granted - expansions, path);
    expansions += found.expansions;
    if (path->size() > 1 || more_m == near_goal_m_) break;
  }
  found.expansions = expansions;
  smooth(search_.body(), query.obstacles, shape_, weights_,
         through_ ? std::optional<Goal>(query.to) : std::nullopt, path);
  return found;
}

double Planner::cost_of_rest(const Query& query, const Path& path, std::size_t from) const {
  return search_.cost_of_rest(path, from, query.terrain, query.obstacles, {query.to, &field_},
                              onward_target());
}

std::optional<Target> Planner::onward_target() const {
  if (!through_) return std::nullopt;
  return Target{*onward_.goal, &onward_field_};
}

void Planner::update_cost(const Query& query, Stamp now) {
  if (!to_.is_of(query.to)) {
    enclosed_since_ = Stamp::max();
    more_m_ = 0.0;
    if (onward_.is_of(query.to)) std::swap(to_, onward_);  // it was the one after it
  }
  if (!to_.is_due(query.to, now)) return;
  to_.goal = query.to;
  to_.computed = now;
  const Pose2d& here = query.start.place;
  more_m_ = 0.0;
  to_.cost.compute(remembered_, query.to, query.forbidden());
  if (to_.cost.reachable_from(here.x_m, here.y_m)) {
    enclosed_since_ = Stamp::max();
    return;
  }
  // The goal may be occupied, or seem so: closer to it the terrain is seen better. If that place is
  // enclosed, too, the vehicle approaches the thinnest barrier until the command fails: the
  // remembered obstacle may have been wrong, or has gone. It may also reach that place on the wrong
  // side of a barrier, and drive around it for ever: the time counts while it comes no nearer.
  more_m_ = near_goal_m_;
  to_.cost.compute(remembered_, {query.to.x_m, query.to.y_m, query.to.radius_m + more_m_},
                   query.forbidden());
  const double away_m = std::hypot(query.to.x_m - here.x_m, query.to.y_m - here.y_m);
  if (enclosed_since_ == Stamp::max() || away_m < nearest_m_ - kNearer_m) {
    enclosed_since_ = now;
    nearest_m_ = away_m;
  }
}

void Planner::update_onward_cost(const Query& query, Stamp now) {
  through_ = false;
  if (!query.onward) return;
  const bool busy = to_.computed == now;  // one computation a cycle
  if (!busy && onward_.is_due(*query.onward, now)) {
    onward_.goal = query.onward;
    onward_.computed = now;
    onward_.cost.compute(remembered_, *query.onward, query.forbidden());
  }
  through_ =
      onward_.is_of(*query.onward) && onward_.cost.reachable_from(query.to.x_m, query.to.y_m);
}

}  // namespace rcs::bg

#include "modules/bg/path_search.h"

#include <algorithm>
#include <cmath>

namespace rcs::bg {
namespace {

constexpr int kStraight = 2;
constexpr int kCurvatures = 2 * kStraight + 1;  // shares of the largest: -1, -3/4, ... 1
constexpr int kSteps = 1;                       // of the curvature, at most, from arc to arc
// The slope of a cell changes by so much with the scans.
constexpr double kSameRoll_rad = 0.02;
constexpr double kMoreRoll_rad = 0.05;
constexpr double kSample_m = 0.4;
constexpr double kSteering = 0.2;    // cost of a metre in which the curvature changes fully
constexpr double kEscape_m = 5.0;    // distance driven out of a blocked cell
constexpr double kTrapped_m = 30.0;  // lower bound of the remaining cost from there

double share(int curvature) { return static_cast<double>(curvature - kStraight) / kStraight; }

int nearest_curvature(double curvature_1pm, const Shape& shape) {
  const double steps = std::round(kStraight * curvature_1pm / shape.max_curvature_1pm);
  return std::clamp(static_cast<int>(steps) + kStraight, 0, kCurvatures - 1);
}

std::size_t first_arc(int curvature, int direction) {
  return static_cast<std::size_t>(2 * curvature + (direction > 0 ? 1 : 0));
}

bool worse(double a, double b) { return a > b; }

}  // namespace

PathSearch::PathSearch(const SearchParams& params, const Shape& shape, const vj::Weights& weights)
    : params_(params),
      shape_(shape),
      weights_(weights),
      body_(shape, std::max(weights.near_m, weights.margin_m)) {
  // A search stays within its horizon, plus a little for reversing.
  bins_ = 2 * static_cast<int>(std::ceil(1.2 * params.horizon_m / params.bin_m)) + 1;
  const std::size_t states = static_cast<std::size_t>(bins_) * static_cast<std::size_t>(bins_) *
                             static_cast<std::size_t>(params.headings) * 4;
  seen_.assign(states, 0);
  best_g_.assign(states, 0.0F);
  const std::size_t most = static_cast<std::size_t>(params.max_expansions) * (kCurvatures + 3) + 1;
  nodes_.reserve(most);
  open_.reserve(most);
  chain_.reserve(1000);
}

std::size_t PathSearch::state(const Node& node) const {
  const auto bin = [&](double x_m, double origin_m) {
    const int k = static_cast<int>(std::floor((x_m - origin_m) / params_.bin_m)) + bins_ / 2;
    return static_cast<std::size_t>(std::clamp(k, 0, bins_ - 1));
  };
  const double turn = node.place.heading_rad / (2.0 * kPi);
  const int heading = static_cast<int>((turn - std::floor(turn)) * params_.headings);
  const std::size_t h = static_cast<std::size_t>(std::min(heading, params_.headings - 1));
  const std::size_t at = bin(node.place.y_m, origin_.y_m) * static_cast<std::size_t>(bins_) +
                         bin(node.place.x_m, origin_.x_m);
  return (at * static_cast<std::size_t>(params_.headings) + h) * 4 + (node.direction > 0 ? 2 : 0) +
         (node.leg > 0 ? 1 : 0);
}

namespace {

bool within(const Pose2d& place, const Goal& goal) {
  return std::hypot(place.x_m - goal.x_m, place.y_m - goal.y_m) < goal.radius_m;
}

}  // namespace

double PathSearch::remaining(const Pose2d& place, int leg) const {
  const double to_target = targets_[static_cast<std::size_t>(leg)].field->at(place.x_m, place.y_m);
  return leg > 0 ? to_target : to_target + onward_cost_;
}

SearchResult PathSearch::search(const vj::Terrain& terrain, const ObstacleDistance& obstacles,
                                const Start& from, const Target& to,
                                const std::optional<Target>& onward, int granted, Path* path) {
  const Pose2d& start = from.place;
  targets_ = {to, onward.value_or(to)};
  onward_cost_ = onward ? onward->field->at(to.goal.x_m, to.goal.y_m) : 0.0;
  // If no way onward is known, the path ends here.
  const bool through = onward && std::isfinite(onward_cost_);
  if (!through) onward_cost_ = 0.0;
  path->clear();
  nodes_.clear();
  open_.clear();
  ++generation_;
  origin_ = start;
  stop_m_ = from.stop_m;
  required_m_ = from.required_m;
  // A vehicle that already rolls by more may leave, but no path rolls it clearly more.
  max_roll_rad_ = std::max(weights_.max_roll_rad, roll(terrain, start) + kSameRoll_rad);

  trapped_ = to.field->blocked(start.x_m, start.y_m);

  SearchResult result;
  const std::int8_t curvature =
      static_cast<std::int8_t>(nearest_curvature(start.curvature_1pm, shape_));
  offer({start, 0.0, 0.0, -1, curvature, static_cast<std::int8_t>(from.direction), 0});
  int best = -1;  // the node with the least remaining cost
  double least = CostField::kNoWay;
  while (!open_.empty()) {
    std::pop_heap(open_.begin(), open_.end(),
                  [](const Open& a, const Open& b) { return worse(a.f, b.f); });
    const Open next = open_.back();
    open_.pop_back();
    const Node node = nodes_[static_cast<std::size_t>(next.node)];
    const std::size_t at = state(node);
    if (static_cast<float>(node.g) > best_g_[at]) continue;  // a better path was found later

    const double rest = next.f - node.g;
    if (rest < least) {
      least = rest;
      best = next.node;
    }
    const bool in_goal = within(node.place, targets_[static_cast<std::size_t>(node.leg)].goal);
    const bool at_end = node.s_m >= params_.horizon_m;
    if ((in_goal && (node.leg > 0 || !through)) || at_end) {
      result.stop = in_goal ? SearchStop::kGoal : SearchStop::kHorizon;
      result.cost = next.f;
      trace(next.node, obstacles, path);
      return result;
    }
    if (result.expansions >= std::min(granted, params_.max_expansions)) {
      result.stop = SearchStop::kBudget;
      break;
    }
    ++result.expansions;
    expand(next.node, terrain, obstacles, in_goal && through);
  }
  // No path to the goal: the path to the node that is nearest to it, if there is any.
  if (best >= 0 && nodes_[static_cast<std::size_t>(best)].parent >= 0) {
    result.stop = SearchStop::kBudget;
    result.cost = least + nodes_[static_cast<std::size_t>(best)].g;
    trace(best, obstacles, path);
  } else {
    result.stop = SearchStop::kNoWay;
  }
  return result;
}

void PathSearch::offer(const Node& node) {
  double rest = remaining(node.place, node.leg);
  if (std::isinf(rest)) {
    // From a blocked cell the vehicle first has to drive out. The remaining cost there is a lower
    // bound.
    if (!trapped_ || node.s_m > kEscape_m) return;
    rest = kTrapped_m;
  }
  const std::size_t at = state(node);
  const float g = static_cast<float>(node.g);
  if (seen_[at] == generation_ && best_g_[at] <= g) return;
  seen_[at] = generation_;
  best_g_[at] = g;
  open_.push_back({node.g + rest, static_cast<int>(nodes_.size())});
  nodes_.push_back(node);
  std::push_heap(open_.begin(), open_.end(),
                 [](const Open& a, const Open& b) { return worse(a.f, b.f); });
}

// The LADAR looks ahead: ground that was neither seen nor driven over may hold a trunk.
bool PathSearch::known_behind(const vj::Terrain& terrain, const Pose2d& place,
                              double margin_m) const {
  const double c = std::cos(place.heading_rad);
  const double s = std::sin(place.heading_rad);
  const double back_m = -0.5 * shape_.length_m - margin_m;
  for (const double share : {-0.5, 0.0, 0.5}) {
    const double aside_m = share * shape_.width_m;
    const Cell cell =
        terrain.cell_at(place.x_m + c * back_m - s * aside_m, place.y_m + s * back_m + c * aside_m);
    if (!terrain.at(cell).known) return false;
  }
  return true;
}

double PathSearch::roll(const vj::Terrain& terrain, const Pose2d& place) {
  const vj::Ground ground = terrain.at(terrain.cell_at(place.x_m, place.y_m));
  return std::abs(vj::roll_on(ground, place.heading_rad));
}

// What was never seen behind the vehicle counts as an obstacle that is nearer than the margin.
double PathSearch::cost_per_m(const vj::Terrain& terrain, const Pose2d& place, int direction,
                              double clearance_m) const {
  const Cell cell = terrain.cell_at(place.x_m, place.y_m);
  const vj::Ground ground = terrain.at(cell);
  const double cost = vj::cost_per_m(ground, clearance_m, weights_) +
                      vj::cost_of_roll(vj::roll_on(ground, place.heading_rad), weights_);
  if (direction > 0) return cost;
  const bool near_unseen =
      clearance_m >= weights_.margin_m && !known_behind(terrain, place, weights_.margin_m);
  return weights_.reverse * (cost + (near_unseen ? weights_.within_margin : 0.0));
}

void PathSearch::expand(int index, const vj::Terrain& terrain, const ObstacleDistance& obstacles,
                        bool reached) {
  Node from = nodes_[static_cast<std::size_t>(index)];
  if (reached) from.leg = 1;
  for (const int direction : {1, -1}) {
    const bool turns_back = from.direction != 0 && from.direction != direction;
    if (turns_back && from.s_m < stop_m_) continue;
    for (int curvature = 0; curvature < kCurvatures; ++curvature) {
      // The curvature changes by a few steps an arc; at rest by any number.
      const bool at_rest = turns_back || from.direction == 0;
      if (!at_rest && std::abs(curvature - from.curvature) > kSteps) continue;
      if (direction < 0 && curvature % kStraight != 0) continue;  // three are enough for reversing
      if (from.parent < 0 && barred_[first_arc(curvature, direction)]) continue;
      Node to = from;
      to.parent = index;
      to.direction = static_cast<std::int8_t>(direction);
      to.curvature = static_cast<std::int8_t>(curvature);
      to.place.curvature_1pm = share(curvature) * shape_.max_curvature_1pm;
      if (turns_back) to.g += weights_.turn_back;
      const int samples = static_cast<int>(std::ceil(params_.arc_m / kSample_m));
      const double step_m = params_.arc_m / samples;
      // Small: a straight path is preferred to a winding one of the same cost.
      const double change = at_rest ? 0.0 : share(curvature) - share(from.curvature);
      const double bend = 0.1 * std::abs(share(curvature)) + kSteering * change * change;
      bool free = true;
      for (int k = 0; k < samples && free; ++k) {
        to.place = along_arc(to.place, direction * step_m);
        const double clearance_m = body_.clearance(obstacles, to.place);
        free = clearance_m >= required_m_ && roll(terrain, to.place) <= max_roll_rad_ &&
               (direction > 0 || known_behind(terrain, to.place, 0.0));
        const double per_m = cost_per_m(terrain, to.place, direction, clearance_m);
        to.g += step_m * (per_m + bend * (direction < 0 ? weights_.reverse : 1.0));
      }
      if (!free) continue;
      to.s_m += params_.arc_m;
      offer(to);
    }
  }
}

void PathSearch::bar(const Path& path) {
  if (path.size() < 2) return;
  const int curvature = nearest_curvature(path[1].place.curvature_1pm, shape_);
  barred_[first_arc(curvature, path[1].direction)] = true;
}

double PathSearch::cost_of_rest(const Path& path, std::size_t from, const vj::Terrain& terrain,
                                const ObstacleDistance& obstacles, const Target& to,
                                const std::optional<Target>& onward) const {
  double cost = 0.0;
  bool reached = false;
  const double begin_rad = from < path.size() ? roll(terrain, path[from].place) : 0.0;
  const double max_roll_rad =
      std::max(weights_.max_roll_rad + kMoreRoll_rad, begin_rad + kSameRoll_rad);
  for (std::size_t k = from + 1; k < path.size(); ++k) {
    const PathPoint& p = path[k];
    reached = reached || within(p.place, to.goal);
    const double clearance_m = body_.clearance(obstacles, p.place);
    if (clearance_m < shape_.min_margin_m) return CostField::kNoWay;
    if (roll(terrain, p.place) > max_roll_rad) return CostField::kNoWay;
    cost += (p.s_m - path[k - 1].s_m) * cost_per_m(terrain, p.place, p.direction, clearance_m);
    if (p.direction != path[k - 1].direction && k > 1) cost += weights_.turn_back;
  }
  if (path.empty()) return CostField::kNoWay;
  const Pose2d& end = path.back().place;
  const double to_target = to.field->at(end.x_m, end.y_m);
  if (!onward) return cost + to_target;
  const double between = onward->field->at(to.goal.x_m, to.goal.y_m);
  if (!std::isfinite(between)) return cost + to_target;
  return cost + (reached ? onward->field->at(end.x_m, end.y_m) : to_target + between);
}

void PathSearch::trace(int index, const ObstacleDistance& obstacles, Path* path) {
  std::vector<int>& chain = chain_;
  chain.clear();
  for (int k = index; k >= 0; k = nodes_[static_cast<std::size_t>(k)].parent) chain.push_back(k);
  const Node& start = nodes_[static_cast<std::size_t>(chain.back())];
  const int first_direction =
      chain.size() > 1 ? nodes_[static_cast<std::size_t>(chain[chain.size() - 2])].direction : 1;
  path->push_back(
      {start.place, first_direction, 0.0, body_.clearance(obstacles, start.place), 0.0, 0.0});
  for (std::size_t n = chain.size() - 1; n-- > 0;) {
    const Node& node = nodes_[static_cast<std::size_t>(chain[n])];
    Pose2d place = nodes_[static_cast<std::size_t>(chain[n + 1])].place;
    place.curvature_1pm = node.place.curvature_1pm;
    const int samples = static_cast<int>(std::ceil(params_.arc_m / kSample_m));
    const double step_m = params_.arc_m / samples;
    for (int k = 0; k < samples; ++k) {
      place = along_arc(place, node.direction * step_m);
      path->push_back({place, node.direction, path->back().s_m + step_m,
                       body_.clearance(obstacles, place), 0.0, 0.0});
    }
  }
}

}  // namespace rcs::bg

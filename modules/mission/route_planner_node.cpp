#include "modules/mission/route_planner_node.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "modules/mission/belief_node.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"

namespace rcs::mission {
namespace {

constexpr Duration kAskAgain = from_seconds(2.0);
constexpr Duration kNoAnswer = from_seconds(30.0);
constexpr double kAround_m = 200.0;  // of the places of a task, where there is no map
constexpr std::size_t kMaxAsked = 900;
constexpr double kOutline_m = 2.5;  // of the vehicle, and what BG keeps in addition to the level
constexpr double kInCell = 0.75;    // of its edge: more than half of its diagonal
constexpr double kNoBound = std::numeric_limits<double>::infinity();

std::int8_t message_verdict(Verdict verdict) {
  switch (verdict) {
    case Verdict::kChosen:
      return route_t::VERDICT_CHOSEN;
    case Verdict::kDearer:
      return route_t::VERDICT_DEARER;
    case Verdict::kAboveLimit:
      return route_t::VERDICT_ABOVE_LIMIT;
    case Verdict::kPending:
      break;
  }
  return route_t::VERDICT_PENDING;
}

/// The tiles of all levels.
Area area_of(const MapIndex& index) {
  constexpr double kFar_m = 1e9;
  Area area{Vec2::Constant(kFar_m), Vec2::Constant(-kFar_m)};
  for (const MapLevelIndex& level : index.levels) {
    const double tile_m = level.level.cell_m * kTileSide;
    for (const MapTileEntry& tile : level.tiles) {
      const Vec2 low = level.level.origin_m + tile_m * Vec2(tile.tile.i, tile.tile.j);
      area.low_m = area.low_m.cwiseMin(low);
      area.high_m = area.high_m.cwiseMax(low + Vec2::Constant(tile_m));
    }
  }
  return area;
}

}  // namespace

Result<std::optional<RouteGround>> load_ground(const MissionConfig& config) {
  std::optional<RouteGround> ground;
  if (config.prior.map.empty()) return ground;
  const Result<MapFolder> folder = MapFolder::open(config.prior.map);
  if (!folder) return folder.error();
  const Result<ElevationMap> map = ElevationMap::load(config.prior.map, config.map_memory_bytes);
  if (!map) return map.error();
  if (Outcome fits = check_frame(map->frame(), config.prior.reference_frame); !fits) {
    return Error{config.prior.map + ": " + fits.error().message};
  }
  ground.emplace(RouteGround{RouteMap(*map, area_of(folder->index()), config.map), map->datum()});
  return ground;
}

RoutePlanner::RoutePlanner(const MissionConfig& config, Bus* bus, std::optional<RouteGround> ground)
    : config_(config),
      predictions_(bus, channel::kWmPathUncertainty, 4),
      queries_(bus, channel::kWmPathQuery),
      routes_out_(bus, channel::kMissionRoutes),
      ground_(std::move(ground)) {
  if (ground_) zones_ = config_.zones.in_world(LocalFrame(ground_->datum));
}

void RoutePlanner::set_datum(const Vec3& datum_deg) {
  const LocalFrame world = frame_at(datum_deg);
  if (ground_) {
    T_map_world_ = LocalFrame(ground_->datum).from(world);
  } else {
    zones_ = config_.zones.in_world(world);
  }
}

Vec2 RoutePlanner::to_map(const Vec3& p_world) const { return (T_map_world_ * p_world).head<2>(); }

Vec2 RoutePlanner::to_world(const Vec2& p_map) const {
  return (T_map_world_.inverse() * Vec3(p_map.x(), p_map.y(), 0.0)).head<2>();
}

std::string_view RoutePlanner::objection(const command_t& task) {
  if (!zones_.forbids()) return "";
  objection_.clear();
  const auto out = std::back_inserter(objection_);
  for (std::size_t k = 0; k < task.waypoint.size(); ++k) {
    const Vec2 at = to_map(from_message(task.waypoint[k].p_m));
    const ZoneClearance nearest = zones_.clearance(at);
    if (nearest.m < 0.0) {
      fmt::format_to(out, "command rejected: waypoint {} is {} '{}'", k + 1,
                     forbidden_side(*nearest.zone), nearest.zone->name);
      return objection_;
    }
    if (task.kind != command_t::KIND_FOLLOW || k == 0) continue;
    const Zone* const zone =
        zones_.conflict(to_map(from_message(task.waypoint[k - 1].p_m)), at, 0.0);
    if (zone == nullptr) continue;
    fmt::format_to(out, "command rejected: the line to waypoint {} is partly {} '{}'", k + 1,
                   forbidden_side(*zone), zone->name);
    return objection_;
  }
  return "";
}

void RoutePlanner::begin_task() {
  stop();
  if (ground_) map().unblock();
}

void RoutePlanner::begin(const Query& query) {
  done_ = query.done;
  places_ = {to_map(query.from)};
  for (std::size_t k = query.done; k < query.task.waypoint.size(); ++k) {
    places_.push_back(to_map(from_message(query.task.waypoint[k].p_m)));
  }
  if (!ground_) {
    Area area{places_.front(), places_.front()};
    for (const Vec2& p : places_) {
      area.low_m = area.low_m.cwiseMin(p);
      area.high_m = area.high_m.cwiseMax(p);
    }
    area.low_m -= Vec2::Constant(kAround_m);
    area.high_m += Vec2::Constant(kAround_m);
    open_ground_ = RouteMap(area, config_.map);
  }
  prescribed_ = query.task.kind == command_t::KIND_FOLLOW;
  // The vehicle never drives above its alert limit, so that BG lets it pass there. A passage that
  // is narrower is open while the position is known well; so are the places of the task.
  clearance_m_ = kOutline_m + query.alert_limit_m;
  min_clearance_m_ = std::min(clearance_m_, kOutline_m + query.level_m);
  for (const Vec2& p : places_) {
    min_clearance_m_ = std::min(min_clearance_m_, zones_.clearance(p).m - kInCell * map().cell_m());
  }
  begin_search();
}

void RoutePlanner::stop() {
  state_ = State::kIdle;
  chosen_ = nullptr;
  stop_asking();
}

void RoutePlanner::stop_asking() {
  asked_ = 0;
  about_rest_ = false;
  rest_sigma_m_.reset();
}

void RoutePlanner::begin_search() {
  state_ = State::kSearching;
  chosen_ = nullptr;
  stop_asking();
  map().set_zones(zones_, clearance_m_, config_.speed_mps);
  if (prescribed_) {
    choice_.prescribe(map(), places_, config_.speed_mps);
  } else {
    choice_.begin(places_, config_.speed_mps);
  }
}

RoutePlanner::State RoutePlanner::step(const Query& query, bool gps, Stamp now, TaskRoute* route) {
  if (choice_.searching()) {
    const bool more = choice_.search(map());
    if (more || !choice_.candidates().empty() || clearance_m_ <= min_clearance_m_) return state_;
    clearance_m_ = min_clearance_m_;
    begin_search();
    return state_;
  }
  if (const Candidate* const next = choice_.unpredicted(); next != nullptr) {
    if (asked_ != 0 && now - asked_since_ > kNoAnswer) {
      choice_.predict(kNoBound);
      asked_ = 0;
    } else if (asked_ == 0 || now - asked_at_ >= kAskAgain) {
      ask(*next, now);
    }
    return state_;
  }
  vj::RouteLimits limits = config_.limits;
  limits.alert_limit_m = query.alert_limit_m;
  limits.undetected_m = query.undetected_m;
  if (!gps) limits.gps_loss_probability = 1.0;
  chosen_ = choice_.choose(limits, gps);
  publish(query, gps, now);
  state_ = State::kIdle;
  predicted_at_ = now;
  if (chosen_ == nullptr) return State::kImpossible;
  *route = route_of(*chosen_, query);
  return State::kChosen;
}

TaskRoute RoutePlanner::route_of(const Candidate& candidate, const Query& query) const {
  const std::vector<waypoint_t>& wanted = query.task.waypoint;
  const auto is_at = [&](const Vec2& p_map, std::size_t waypoint) {
    constexpr double kSame_m = 0.1;
    return waypoint < wanted.size() &&
           (from_message(wanted[waypoint].p_m).head<2>() - to_world(p_map)).norm() < kSame_m;
  };
  // The line leads through all waypoints that were not done when the search began.
  const Vec2 here = to_map(query.from);
  const std::vector<Vec2> places = divided(candidate.line, config_.spacing_m);
  std::size_t next = done_;
  std::size_t first = places.size();  // the next waypoint of the task
  for (std::size_t k = 0; k < places.size() && first == places.size(); ++k) {
    if (!is_at(places[k], next)) continue;
    if (next == query.done) first = k;
    ++next;
  }
  first = first_ahead(candidate.line.front(), places, first, here);

  TaskRoute route;
  next = query.done;
  for (std::size_t k = first; k < places.size(); ++k) {
    const Vec2 p = to_world(places[k]);
    RoutePlace place{Vec3(p.x(), p.y(), 0.0), config_.corridor_m};
    if (is_at(places[k], next)) {
      place = {from_message(wanted[next].p_m), wanted[next].radius_m};
      route.ends.push_back(route.places.size() + 1);
      ++next;
    }
    route.places.push_back(place);
  }
  return route;
}

bool RoutePlanner::keeps_limit(const Query& query, const BgRoute& route, Stamp now) {
  const std::size_t done = route.done();
  const bool over = done == route.places().size();
  if (chosen_ == nullptr || !chosen_->value.keeps_limit || over) return true;
  if (rest_sigma_m_) {
    vj::RouteForecast forecast = chosen_->forecast;
    forecast.sigma_m = *rest_sigma_m_;
    rest_sigma_m_.reset();
    predicted_at_ = now;
    vj::RouteLimits limits = config_.limits;
    limits.alert_limit_m = query.alert_limit_m;
    limits.undetected_m = query.undetected_m;
    return value_of(forecast, limits).keeps_limit;
  }
  const bool unanswered = asked_ != 0 && now - asked_since_ > kNoAnswer;
  if (unanswered) {
    stop_asking();
    predicted_at_ = now;
  }
  const bool due =
      asked_ == 0 ? now - predicted_at_ >= config_.predict_again : now - asked_at_ >= kAskAgain;
  if (!due) return true;
  std::vector<Vec2> places;
  places.reserve(route.places().size() - done);
  for (std::size_t k = done; k < route.places().size(); ++k) {
    places.emplace_back(route.places()[k].p.head<2>());
  }
  about_rest_ = true;
  ask(places, now);
  return true;
}

void RoutePlanner::ask(const Candidate& candidate, Stamp now) {
  std::vector<Vec2> places;
  places.reserve(candidate.line.size());
  for (std::size_t k = 1; k < candidate.line.size(); ++k) {
    places.push_back(to_world(candidate.line[k]));
  }
  ask(places, now);
}

void RoutePlanner::ask(const std::vector<Vec2>& places, Stamp now) {
  path_query_t query{};
  query.utime = to_utime(now);
  query.issuer = kIssuer;
  if (asked_ == 0) {
    asked_ = query.utime;
    asked_since_ = now;
  }
  query.serial = asked_;
  asked_at_ = now;
  const std::size_t each = places.size() / kMaxAsked + 1;
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (k % each != 0 && k + 1 != places.size()) continue;
    query.x_m.push_back(places[k].x());
    query.y_m.push_back(places[k].y());
  }
  query.n = static_cast<std::int32_t>(query.x_m.size());
  queries_.publish(&query);
}

void RoutePlanner::take_predictions() {
  for (; !predictions_.empty(); predictions_.pop()) {
    const path_uncertainty_t& m = *predictions_.front();
    if (m.issuer != kIssuer || m.serial != asked_ || asked_ == 0) continue;
    double sigma_m = kNoBound;
    if (m.state == path_uncertainty_t::STATE_ANSWERED && m.n > 0) {
      sigma_m = 0.0;
      for (const float s : m.sigma_with_map_m) sigma_m = std::max<double>(sigma_m, s);
      sigma_m = std::hypot(sigma_m, m.map_bias_sigma_m);
    }
    const bool predicted = std::isfinite(sigma_m);
    asked_ = 0;
    if (!about_rest_) choice_.predict(predicted ? sigma_m : kNoBound);
    if (about_rest_ && predicted) rest_sigma_m_ = sigma_m;
    about_rest_ = false;
  }
}

void RoutePlanner::block(const Vec3& p_world, double radius_m) {
  if (ground_) map().block(to_map(p_world), radius_m);
}

void RoutePlanner::publish(const Query& query, bool gps, Stamp now) {
  routes_.utime = to_utime(now);
  routes_.issuer = query.task.issuer;
  routes_.serial = query.task.serial;
  routes_.alert_limit_m = query.alert_limit_m;
  routes_.gps = gps ? 1 : 0;
  routes_.route.clear();
  for (const Candidate& c : choice_.candidates()) {
    route_t r{};
    r.poverty_weight = c.poverty_weight;
    r.verdict = message_verdict(c.verdict);
    r.length_m = c.forecast.length_m;
    r.time_s = c.forecast.time_s;
    r.sigma_max_m = c.forecast.sigma_m;
    r.level_max_m = c.value.level_m;
    r.risk = c.value.risk;
    r.cost_s = c.value.cost_s;
    for (const Vec2& p_map : c.line) {
      const Vec2 p = to_world(p_map);
      r.x_m.push_back(p.x());
      r.y_m.push_back(p.y());
    }
    r.n = static_cast<std::int32_t>(r.x_m.size());
    routes_.route.push_back(std::move(r));
  }
  routes_.n = static_cast<std::int32_t>(routes_.route.size());
  routes_out_.publish(&routes_);
}

}  // namespace rcs::mission

#include "modules/mission/mission_node.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"
#include "lcmtypes/plausible.h"
#include "rcs/node/budget.h"
#include "rcs/node/waypoint_check.h"
#include "rcs/terrain/map_folder.h"
#include "rcs/terrain/map_tile.h"

namespace rcs::mission {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);
constexpr int kNavStates = 128;  // of a period of up to 1 s: the way is noted from all of them
constexpr double kBlockedAhead_m = 12.0;  // where an obstacle is assumed that BG does not pass
constexpr double kBlocked_m = 8.0;
constexpr double kBegun_m = 4.0;  // places of the way back that are nearer are not driven to
constexpr double kStart_m = 0.5;  // radius of the start, where the way back ends

TaskKind kind_of(const command_t& m) {
  switch (m.kind) {
    case command_t::KIND_HALT:
    case command_t::KIND_ABORT:
    // The stop itself is BG's; after it the vehicle holds until another task.
    case command_t::KIND_EMERGENCY_STOP:
    case command_t::KIND_RELEASE:
      return TaskKind::kHold;
    case command_t::KIND_GOTO:
      return TaskKind::kVisit;
    case command_t::KIND_FOLLOW:
      return TaskKind::kFollow;
    case command_t::KIND_RETURN:
      return TaskKind::kReturn;
    default:
      return TaskKind::kUnknown;
  }
}

/// Along waypoints of frame world.
bool needs_route(TaskKind kind) { return kind == TaskKind::kVisit || kind == TaskKind::kFollow; }

/// Why the content of a task cannot be executed; empty: it can.
std::string_view objection(const command_t& m) {
  if (!needs_route(kind_of(m))) return "";
  if (m.frame != command_t::FRAME_WORLD) {
    return "command rejected: the waypoints of a task are not in frame world";
  }
  return waypoint_objection(m);
}

std::int8_t message_status(Status status) {
  switch (status) {
    case Status::kExecuting:
      return status_t::STATUS_EXEC;
    case Status::kDone:
      return status_t::STATUS_DONE;
    case Status::kError:
      return status_t::STATUS_ERROR;
    case Status::kUninitialized:
      break;
  }
  return status_t::STATUS_UNINITIALIZED;
}

}  // namespace

MissionNode::MissionNode(const MissionConfig& config, Bus* bus, std::optional<RouteGround> ground)
    : config_(config),
      clock_(config.period),
      subordinate_(bus, config.info.name, channel::kMissionCommand, channel::kBgStop,
                   channel::kMissionStatus, {}),
      port_(bus, channel::kBgCommand, channel::kBgStop, channel::kBgStatus, kIssuer, {}),
      nav_states_(bus, channel::kWmNavState, kNavStates),
      integrities_(bus, channel::kWmIntegrity, 1),
      planner_(config, bus, std::move(ground)),
      report_(bus, config.info.name, kReportInterval) {}

std::vector<const InboxBase*> MissionNode::inboxes() const {
  return {&subordinate_.inbox(), &subordinate_.stop_inbox(), &port_.inbox(), &nav_states_,
          &integrities_,         &planner_.inbox()};
}

void MissionNode::run(const Cycle& cycle) {
  subordinate_.take(cycle.now);
  take_nav(cycle.now);
  take_task();
  port_.step(cycle.now);
  const status_t* const bg = port_.status();
  if (bg != nullptr && port_.confirmed() && bg->issuer == kIssuer) {
    bg_route_.note(bg->waypoints_done);
  }
  planner_.take_predictions();
  check_zones();
  cycle.stages->mark("receive");

  const Decision decision = decide(facts(cycle.now), config_.decide);
  act(decision, cycle.now);
  cycle.stages->mark("act");
  publish_status(decision, cycle.now);
  if (clock_.due(cycle.now)) clock_.advance(cycle.now);
  cycle.stages->close_account();
}

// A command of the same task renews it.
void MissionNode::take_task() {
  if (!subordinate_.is_new()) return;
  const command_t& m = *subordinate_.command();
  if (m.task != 0 && m.task == task_of_ && m.issuer == issuer_) return;
  task_of_ = m.task;
  issuer_ = m.issuer;
  cannot_ = objection(m);
  zones_unchecked_ = true;
  places_done_ = 0;
  route_state_ = RouteState::kNone;
  planner_.stop();
  returning_ = on_way_back_ = false;
  bg_route_.clear();
  blocked_ = 0;
  above_since_ = Stamp::max();
}

// The position of a waypoint relative to zones is known from the first pose in frame world on.
void MissionNode::check_zones() {
  const command_t* const task = subordinate_.command();
  if (!zones_unchecked_ || !world_valid_ || task == nullptr || !needs_route(kind_of(*task))) return;
  zones_unchecked_ = false;
  if (cannot_.empty()) cannot_ = planner_.objection(*task);
}

void MissionNode::take_nav(Stamp now) {
  for (; !nav_states_.empty(); nav_states_.pop()) {
    const nav_state_t& m = *nav_states_.front();
    Pose T_world_vehicle;
    if (!plausible_motion(m) ||
        !from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T_world_vehicle)) {
      report_.publish(now, event::kMissionInputRejected, "{} rejected: pose or velocity invalid",
                      channel::kWmNavState);
      continue;
    }
    nav_arrival_ = nav_states_.front_arrival();
    pose_valid_ =
        m.pose_valid != 0 && m.mode != nav_state_t::MODE_ALIGN && m.mode != nav_state_t::MODE_LOST;
    world_valid_ = m.world_valid != 0;
    T_world_vehicle_ = T_world_vehicle;
    own_map_m_ = local_levels(m).horizontal_m;
    sigma_world_m_ = std::sqrt(horizontal_variance(m.cov_world_pose, T_world_vehicle));
    gps_age_ = m.age_gps_us < 0 ? Duration::max() : Duration(m.age_gps_us);
    here_ = {from_message(m.p_rolling_vehicle_m), m.rolling_valid != 0 ? m.map_epoch : -1,
             T_world_vehicle.p, world_valid_};
    note_way();
    const Vec3 datum(m.datum_lat_deg, m.datum_lon_deg, m.datum_height_m);
    if (!world_valid_ || datum == datum_) continue;
    datum_ = datum;
    planner_.set_datum(datum);
    zones_unchecked_ = true;
  }
  for (; !integrities_.empty(); integrities_.pop()) {
    const integrity_t& m = *integrities_.front();
    // Written so that NaN is rejected.
    if (!(m.protection_horizontal_m >= 0.0)) {
      report_.publish(now, event::kMissionInputRejected, "{} rejected: protection level invalid",
                      channel::kWmIntegrity);
      continue;
    }
    level_m_ = m.validity == integrity_t::VALID_WORLD ? m.protection_horizontal_m
                                                      : std::numeric_limits<double>::infinity();
  }
}

void MissionNode::note_way() {
  if (pose_valid_ && !on_way_back_) way_.note(here_);
}

double MissionNode::alert_limit_m() const {
  const command_t* const c = subordinate_.command();
  return c != nullptr && c->alert_limit_horizontal_m > 0.0 ? c->alert_limit_horizontal_m
                                                           : config_.limits.alert_limit_m;
}

Facts MissionNode::facts(Stamp now) {
  Facts f;
  const command_t* const command = subordinate_.command();
  if (command != nullptr) {
    f.task = kind_of(*command);
    f.operator_received = subordinate_.valid(now);
    f.cannot = cannot_;
  }
  if (nav_arrival_ != Stamp::min()) f.wm_age = now - nav_arrival_;
  const status_t* const bg = port_.status();
  if (bg != nullptr) {
    f.bg_age = now - from_utime(bg->utime);
    f.emergency_stop = bg->emergency_stop != status_t::STOP_NONE;
    f.bg_no_path =
        !bg_route_.empty() && port_.confirmed() && bg->issuer == kIssuer && bg->state == "NO_PATH";
  }
  f.pose_valid = pose_valid_;
  f.world_known = world_valid_;
  f.gps = gps_age_ <= config_.gps_loss;
  f.world_level = level_m_ / alert_limit_m();
  f.own_map_level = own_map_m_ / alert_limit_m();
  if (f.world_level <= 1.0) {
    above_since_ = Stamp::max();
  } else if (above_since_ == Stamp::max()) {
    above_since_ = now;
  }
  f.above_limit = above_since_ == Stamp::max() ? Duration(0) : now - above_since_;
  f.can_return = way_.begins_in(here_.epoch);
  f.returning = returning_;
  f.route = route_state_;
  f.blocked = blocked_;
  f.arrived = bg_route_.arrived() && (!on_way_back_ || to_the_start_);
  return f;
}

void MissionNode::act(const Decision& decision, Stamp now) {
  switch (decision.action) {
    case Action::kNone:
      return;
    case Action::kHalt:
      return send(command_t::KIND_HALT, now);
    case Action::kInitialize:
      if (bg_route_.empty()) begin_towards_first_place(now);
      return send(command_t::KIND_GOTO, now);
    case Action::kReplan:
      exclude_blocked(now);
      begin_route();
      return send(command_t::KIND_HALT, now);
    case Action::kSearch:
      if (!planner_.searching()) begin_route();
      plan(now);
      return send(command_t::KIND_HALT, now);
    case Action::kDrive: {
      const bool gps = gps_age_ <= config_.gps_loss;
      if (!planner_.searching() && chosen_with_gps_ && !gps) begin_route();
      if (planner_.searching()) plan(now);
      return send(command_t::KIND_GOTO, now);
    }
    case Action::kReturn: {
      const command_t* const command = subordinate_.command();
      returning_ = command == nullptr || kind_of(*command) != TaskKind::kReturn;
      const bool other_map = rolling_ && here_.epoch != epoch_;
      if (!on_way_back_ || other_map || (bg_route_.arrived() && !to_the_start_)) begin_return(now);
      return send(command_t::KIND_GOTO, now);
    }
  }
}

RoutePlanner::Query MissionNode::route_query() const {
  // Undetected faults are assumed to add as much to the level along the route as now.
  const double of_sigma_m = kHorizontalQuantile * sigma_world_m_;
  const double undetected_m =
      std::isfinite(level_m_ - of_sigma_m) ? std::max(0.0, level_m_ - of_sigma_m) : 0.0;
  return {*subordinate_.command(), places_done_, T_world_vehicle_.p, level_m_, undetected_m,
          alert_limit_m()};
}

void MissionNode::begin_route() {
  planner_.begin(route_query());
  if (route_state_ != RouteState::kChosen) route_state_ = RouteState::kSearching;
}

void MissionNode::begin_towards_first_place(Stamp now) {
  const waypoint_t& first = subordinate_.command()->waypoint.front();
  bg_route_.begin({{from_message(first.p_m), first.radius_m}});
  place_ends_.clear();
  rolling_ = on_way_back_ = false;
  task_ = to_utime(now);
}

void MissionNode::plan(Stamp now) {
  const bool gps = gps_age_ <= config_.gps_loss;
  TaskRoute route;
  const RoutePlanner::State state = planner_.step(route_query(), gps, now, &route);
  if (state == RoutePlanner::State::kSearching) return;
  chosen_with_gps_ = gps;
  if (state == RoutePlanner::State::kImpossible) {
    route_state_ = RouteState::kImpossible;
    return;
  }
  const Candidate& best = planner_.chosen();
  report_.publish(
      now, event::kMissionRoute,
      "route of {:.0f} m of {} candidates: {:.0f} s, largest level without GPS {:.1f} m "
      "of {:.1f} m, cost {:.0f} s",
      best.forecast.length_m, planner_.candidates(), best.forecast.time_s, best.value.level_m,
      alert_limit_m(), best.value.cost_s);
  route_state_ = RouteState::kChosen;
  bg_route_.begin(std::move(route.places));
  place_ends_ = std::move(route.ends);
  rolling_ = on_way_back_ = false;
  task_ = to_utime(now);
}

void MissionNode::begin_return(Stamp now) {
  way_.cut(here_);
  const WayPart part = way_.first_part(here_.epoch);
  rolling_ = part.rolling;
  epoch_ = here_.epoch;
  to_the_start_ = part.to_the_start;
  std::vector<RoutePlace> places;
  const Vec3& here = rolling_ ? here_.p_rolling : here_.p_world;
  for (const Vec3& p : part.places) {
    if (places.empty() && (p - here).head<2>().norm() < kBegun_m && &p != &part.places.back()) {
      continue;
    }
    places.push_back({p, config_.way_back_m});
  }
  if (to_the_start_ && !places.empty()) places.back().radius_m = kStart_m;
  bg_route_.begin(std::move(places));
  place_ends_.clear();
  on_way_back_ = true;
  planner_.stop();
  task_ = to_utime(now);
}

// BG found no path to the next place: what is between must be blocked.
void MissionNode::exclude_blocked(Stamp now) {
  if (bg_route_.empty() || bg_route_.arrived()) return;
  const Vec3 to = bg_route_.places()[bg_route_.done()].p - T_world_vehicle_.p;
  const Vec2 way = to.head<2>();
  const Vec2 at = T_world_vehicle_.p.head<2>() +
                  std::min(1.0, kBlockedAhead_m / std::max(0.1, way.norm())) * way;
  ++blocked_;
  planner_.block(Vec3(at.x(), at.y(), 0.0), kBlocked_m);
  report_.publish(now, event::kMissionBlocked,
                  "BG found no path to place {} of {}: ground around E {:.0f} N {:.0f} m excluded",
                  bg_route_.done() + 1, bg_route_.places().size(), at.x(), at.y());
  bg_route_.clear();
  route_state_ = RouteState::kNone;
}

void MissionNode::send(std::int8_t kind, Stamp now) {
  if (kind == command_t::KIND_HALT) {
    // In force at BG until another command arrives, also when it has expired.
    if (sent_ == kind) return;
    sent_ = kind;
    port_.send({}, now);
    return;
  }
  while (places_done_ < subordinate_.command()->waypoint.size() && !place_ends_.empty() &&
         bg_route_.done() >= place_ends_.front()) {
    ++places_done_;
    place_ends_.erase(place_ends_.begin());
  }
  if (sent_ != kind) bg_route_.resume();
  bg_route_.advance();
  sent_ = kind;
  const command_t& task = *subordinate_.command();
  Command command;
  command.kind = command_t::KIND_GOTO;
  command.frame = rolling_ ? command_t::FRAME_ROLLING : command_t::FRAME_WORLD;
  command.map_epoch = rolling_ ? epoch_ : 0;
  command.task = task_;
  command.alert_limit_horizontal_m = task.alert_limit_horizontal_m;
  command.alert_limit_vertical_m = task.alert_limit_vertical_m;
  command.valid_for = config_.command_valid;
  double speed_mps = on_way_back_ ? config_.way_back_mps : config_.max_speed_mps;
  if (!on_way_back_ && places_done_ < task.waypoint.size()) {
    speed_mps = task.waypoint[places_done_].speed_mps;
  }
  for (std::size_t k = bg_route_.first(); k < bg_route_.last(); ++k) {
    const RoutePlace& place = bg_route_.places()[k];
    waypoint_t w{};
    to_message(place.p, w.p_m);
    w.radius_m = place.radius_m;
    w.speed_mps = speed_mps;
    command.waypoints.push_back(w);
  }
  port_.send(command, now);
}

void MissionNode::publish_status(const Decision& decision, Stamp now) {
  StatusReport status;
  status.status = message_status(decision.status);
  status.state = decision.state;
  status.line = decision.line;
  status.reason = decision.reason;
  status.waypoints_done = static_cast<int>(places_done_);
  subordinate_.report(now, status);
  if (decision.state == reported_state_) return;
  report_.publish(now, event::kMissionState, "{} -> {}{}{}",
                  reported_state_.empty() ? std::string_view("start") : reported_state_,
                  decision.state, decision.reason.empty() ? "" : ": ", decision.reason);
  reported_state_ = decision.state;
}

namespace {

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

Result<std::unique_ptr<Node>> make_mission_node(const ParamFile& file, Bus* bus) {
  const Result<MissionConfig> config = load_mission_config(file);
  if (!config) return config.error();
  std::optional<RouteGround> ground;
  if (!config->prior.map.empty()) {
    const Result<MapFolder> folder = MapFolder::open(config->prior.map);
    if (!folder) return folder.error();
    const Result<ElevationMap> map =
        ElevationMap::load(config->prior.map, config->map_memory_bytes);
    if (!map) return map.error();
    if (Outcome fits = check_frame(map->frame(), config->prior.reference_frame); !fits) {
      return Error{config->prior.map + ": " + fits.error().message};
    }
    ground.emplace(
        RouteGround{RouteMap(*map, area_of(folder->index()), config->map), map->datum()});
  }
  return std::unique_ptr<Node>(std::make_unique<MissionNode>(*config, bus, std::move(ground)));
}

}  // namespace rcs::mission

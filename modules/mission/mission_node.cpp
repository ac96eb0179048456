#include "modules/mission/mission_node.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"
#include "rcs/base/protection_quantiles.h"
#include "rcs/node/budget.h"
#include "rcs/node/waypoint_check.h"

namespace rcs::mission {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);
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

BgError error_of(const status_t& bg) {
  if (bg.status != status_t::STATUS_ERROR) return BgError::kNone;
  return bg.state == "NO_PATH"    ? BgError::kNoPath
         : bg.state == "REJECTED" ? BgError::kRejected
         : bg.state == "ZONE"     ? BgError::kZone
                                  : BgError::kNone;
}

/// BG's table words its reasons so if what it waits for ends by itself.
bool waits(const status_t& bg) {
  return bg.status == status_t::STATUS_EXEC && bg.reason.rfind("waiting because", 0) == 0;
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
      belief_(bus),
      planner_(config, bus, std::move(ground)),
      report_(bus, config.info.name, kReportInterval) {}

std::vector<const InboxBase*> MissionNode::inboxes() const {
  return {&subordinate_.inbox(), &subordinate_.stop_inbox(), &port_.inbox(),
          &belief_.nav_inbox(),  &belief_.integrity_inbox(), &planner_.inbox()};
}

void MissionNode::run(const Cycle& cycle) {
  subordinate_.take(cycle.now);
  if (stopped()) subordinate_.end_tasks();
  belief_.take(cycle.now, !on_way_back(), &way_, &report_);
  take_datum();
  take_task();
  port_.step(cycle.now);
  note_bg(cycle.now);
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

// Also if the stop began and ended between two cycles.
bool MissionNode::stopped() const {
  const status_t* const bg = port_.status();
  return !subordinate_.stops().empty() ||
         (bg != nullptr && bg->emergency_stop != status_t::STOP_NONE);
}

// A command of the same task renews it.
void MissionNode::take_task() {
  if (!subordinate_.is_new()) return;
  const command_t& m = *subordinate_.command();
  if (m.task != 0 && m.task == task_.task && m.issuer == task_.issuer) return;
  task_ = m;
  cannot_ = objection(m);
  zones_unchecked_ = true;
  places_done_ = 0;
  returning_ = false;
  leads_ = Leads::kTask;
  drop_bg_route();
  planner_.begin_task();
  blocked_ = 0;
  rejected_ = false;
  above_since_ = Stamp::max();
}

// In another frame world the places of the task are where they were, and its route is unknown.
void MissionNode::take_datum() {
  if (!belief_.datum_is_new()) return;
  planner_.set_datum(*belief_.newest().datum);
  zones_unchecked_ = true;
  for (waypoint_t& w : task_.waypoint) {
    to_message(belief_.T_world_before() * from_message(w.p_m), w.p_m);
  }
  if (!rolling_) drop_bg_route();
}

// The position of a waypoint relative to zones is known from the first pose in frame world on.
void MissionNode::check_zones() {
  const bool known = belief_.newest().world_valid && subordinate_.command() != nullptr;
  if (!zones_unchecked_ || !known || !needs_route(kind_of(task_))) return;
  zones_unchecked_ = false;
  if (cannot_.empty()) cannot_ = planner_.objection(task_);
}

double MissionNode::alert_limit_m() const {
  return task_.alert_limit_horizontal_m > 0.0 ? task_.alert_limit_horizontal_m
                                              : config_.limits.alert_limit_m;
}

void MissionNode::note_bg(Stamp now) {
  bg_waits_.clear();
  const status_t* const bg = port_.status();
  if (bg == nullptr || !port_.confirmed() || bg->issuer != kIssuer) return;
  bg_route_.note(bg->waypoints_done);
  while (!place_ends_.empty() && bg_route_.done() >= place_ends_.front()) {
    ++places_done_;
    place_ends_.erase(place_ends_.begin());
  }
  note_bg_error(*bg, now);
  if (waits(*bg)) bg_waits_ = bg->reason;
}

// While BG halts, the error for which it was commanded to halt remains.
void MissionNode::note_bg_error(const status_t& bg, Stamp now) {
  if (sent_ != command_t::KIND_GOTO || bg_route_.empty()) return;
  // The way back begins again anyway.
  const bool other_map = rolling_ && belief_.newest().here.epoch != epoch_;
  const BgError error = other_map ? BgError::kNone : error_of(bg);
  if (error != bg_error_) bg_error_since_ = now;
  bg_error_ = error;
  executed_ = executed_ || error != BgError::kRejected;
  bg_reason_ = bg.reason.empty() ? "behavior generation reports an error" : bg.reason;
  bg_error_for_ = now - bg_error_since_;
}

Facts MissionNode::facts(Stamp now) {
  const Belief& belief = belief_.newest();
  Facts f;
  if (subordinate_.command() != nullptr) {
    f.task = kind_of(task_);
    f.operator_received = subordinate_.valid(now);
    f.cannot = subordinate_.task_ended()
                   ? "command rejected: an emergency stop has ended its task; give a new command"
                   : cannot_;
  }
  if (belief.arrival != Stamp::min()) f.wm_age = now - belief.arrival;
  const status_t* const bg = port_.status();
  if (bg != nullptr) f.bg_age = now - from_utime(bg->utime);
  f.bg_error = bg_error_;
  f.bg_reason = bg_reason_;
  f.bg_error_for = bg_error_for_;
  f.bg_waits = bg_waits_;
  f.bg_on_task_route = leads_ == Leads::kTask;
  f.emergency_stop = stopped();
  f.pose_valid = belief.pose_valid;
  f.world_known = belief.world_valid;
  f.gps = gps();
  f.world_level = belief.level_m / alert_limit_m();
  f.own_map_level = belief.own_map_m / alert_limit_m();
  if (f.world_level <= 1.0) {
    above_since_ = Stamp::max();
  } else if (above_since_ == Stamp::max()) {
    above_since_ = now;
  }
  f.above_limit = above_since_ == Stamp::max() ? Duration(0) : now - above_since_;
  f.can_return = way_.begins_in(belief.here.epoch);
  f.returning = returning_;
  f.route = route_state_;
  f.blocked = blocked_;
  f.rejected_for_good = rejected_ || executed_;
  f.arrived =
      bg_route_.arrived() && (leads_ == Leads::kTask || (leads_ == Leads::kBack && to_the_start_));
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
    case Action::kRestart:
      rejected_ = true;
      drop_bg_route();
      return send(command_t::KIND_HALT, now);
    case Action::kSearch:
      if (!planner_.searching()) begin_route();
      plan(now);
      return send(command_t::KIND_HALT, now);
    case Action::kDrive:
      if (!planner_.searching() &&
          ((chosen_with_gps_ && !gps()) || !planner_.keeps_limit(route_query(), bg_route_, now))) {
        begin_route();
      }
      if (planner_.searching()) plan(now);
      return send(command_t::KIND_GOTO, now);
    case Action::kReturn: {
      returning_ = kind_of(task_) != TaskKind::kReturn;
      const bool other_map = rolling_ && belief_.newest().here.epoch != epoch_;
      const bool next_part = bg_route_.arrived() && !to_the_start_;
      if (!on_way_back() || other_map || next_part) begin_return(now);
      return send(command_t::KIND_GOTO, now);
    }
  }
}

RoutePlanner::Query MissionNode::route_query() const {
  // Undetected faults are assumed to add as much to the level along the route as now.
  const Belief& belief = belief_.newest();
  const double of_sigma_m = kHorizontalQuantile * belief.sigma_world_m;
  const double undetected_m =
      std::isfinite(belief.level_m - of_sigma_m) ? std::max(0.0, belief.level_m - of_sigma_m) : 0.0;
  return {task_,          places_done_, belief.T_world_vehicle.p,
          belief.level_m, undetected_m, alert_limit_m()};
}

void MissionNode::begin_route() {
  planner_.begin(route_query());
  if (route_state_ != RouteState::kChosen) route_state_ = RouteState::kSearching;
}

void MissionNode::begin_towards_first_place(Stamp now) {
  const waypoint_t& first = task_.waypoint.front();
  rolling_ = false;
  begin_bg_route(Leads::kAhead, {{from_message(first.p_m), first.radius_m}}, now);
}

void MissionNode::plan(Stamp now) {
  TaskRoute route;
  const RoutePlanner::State state = planner_.step(route_query(), gps(), now, &route);
  if (state == RoutePlanner::State::kSearching) return;
  chosen_with_gps_ = gps();
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
  rolling_ = false;
  begin_bg_route(Leads::kTask, std::move(route.places), now);
  place_ends_ = std::move(route.ends);
}

bool MissionNode::on_way_back() const { return leads_ == Leads::kBack && !bg_route_.empty(); }

void MissionNode::begin_return(Stamp now) {
  const Breadcrumb& here = belief_.newest().here;
  way_.begin_return(here);
  const WayPart part = way_.first_part(here.epoch);
  rolling_ = part.rolling;
  epoch_ = here.epoch;
  to_the_start_ = part.to_the_start;
  std::vector<RoutePlace> places;
  const Vec3& p_here = rolling_ ? here.p_rolling : here.p_world;
  for (const Vec3& p : part.places) {
    if (places.empty() && (p - p_here).head<2>().norm() < kBegun_m && &p != &part.places.back()) {
      continue;
    }
    places.push_back({p, config_.way_back_m});
  }
  if (to_the_start_ && !places.empty()) places.back().radius_m = kStart_m;
  planner_.stop();
  begin_bg_route(Leads::kBack, std::move(places), now);
}

void MissionNode::begin_bg_route(Leads leads, std::vector<RoutePlace> places, Stamp now) {
  leads_ = leads;
  bg_route_.begin(std::move(places));
  place_ends_.clear();
  bg_error_ = BgError::kNone;
  executed_ = false;
  bg_task_ = to_utime(now);
}

void MissionNode::drop_bg_route() {
  bg_route_.clear();
  place_ends_.clear();
  bg_error_ = BgError::kNone;
  if (leads_ == Leads::kBack) return;
  leads_ = Leads::kTask;
  rolling_ = false;
  route_state_ = RouteState::kNone;
  planner_.stop();
}

// BG found no path to the next place: what is between must be blocked.
void MissionNode::exclude_blocked(Stamp now) {
  if (bg_route_.empty() || bg_route_.arrived()) return;
  const Vec3& here = belief_.newest().T_world_vehicle.p;
  const Vec2 way = (bg_route_.places()[bg_route_.done()].p - here).head<2>();
  const Vec2 at = here.head<2>() + std::min(1.0, kBlockedAhead_m / std::max(0.1, way.norm())) * way;
  ++blocked_;
  planner_.block(Vec3(at.x(), at.y(), 0.0), kBlocked_m);
  report_.publish(now, event::kMissionBlocked,
                  "BG found no path to place {} of {}: ground around E {:.0f} N {:.0f} m excluded",
                  bg_route_.done() + 1, bg_route_.places().size(), at.x(), at.y());
  drop_bg_route();
}

void MissionNode::send(std::int8_t kind, Stamp now) {
  if (kind == command_t::KIND_HALT) {
    // In force at BG until another command arrives, also when it has expired.
    if (sent_ == kind) return;
    sent_ = kind;
    port_.send({}, now);
    return;
  }
  if (sent_ != kind) {
    bg_route_.resume();
    bg_error_ = BgError::kNone;
  }
  bg_route_.advance();
  sent_ = kind;
  Command command;
  command.kind = command_t::KIND_GOTO;
  command.frame = rolling_ ? command_t::FRAME_ROLLING : command_t::FRAME_WORLD;
  command.map_epoch = rolling_ ? epoch_ : 0;
  command.task = bg_task_;
  command.alert_limit_horizontal_m = alert_limit_m();
  command.alert_limit_vertical_m = task_.alert_limit_vertical_m;
  command.valid_for = config_.command_valid;
  double speed_mps = leads_ == Leads::kBack ? config_.way_back_mps : config_.max_speed_mps;
  if (leads_ != Leads::kBack && places_done_ < task_.waypoint.size()) {
    speed_mps = task_.waypoint[places_done_].speed_mps;
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
  if (const status_t* const bg = port_.status()) status.emergency_stop = bg->emergency_stop;
  subordinate_.report(now, status);
  if (decision.state == reported_state_) return;
  report_.publish(now, event::kMissionState, "{} -> {}{}{}",
                  reported_state_.empty() ? std::string_view("start") : reported_state_,
                  decision.state, decision.reason.empty() ? "" : ": ", decision.reason);
  reported_state_ = decision.state;
}

Result<std::unique_ptr<Node>> make_mission_node(const ParamFile& file, Bus* bus) {
  const Result<MissionConfig> config = load_mission_config(file);
  if (!config) return config.error();
  Result<std::optional<RouteGround>> ground = load_ground(*config);
  if (!ground) return ground.error();
  return std::unique_ptr<Node>(
      std::make_unique<MissionNode>(*config, bus, std::move(ground).value()));
}

}  // namespace rcs::mission

#include "modules/bg/bg_node.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/events.h"

namespace rcs::bg {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);
constexpr Duration kHeld = from_seconds(1.0);  // longer than the wheels need to turn
constexpr double kFreed_m = 0.5;               // distance driven after a blocked path
constexpr Duration kUnregistered = from_seconds(5.0);
constexpr double kLeadBack_m = 10.0;
constexpr Duration kStuck = from_seconds(2.0);  // without a path, in an obstacle
constexpr double kInside_m = 0.1;               // of the outline; less is the rounding of the map
constexpr double kAnywhere_m = 100.0;
constexpr double kBeforeObstacle_m = 1.0;  // on a way back
constexpr double kBeforeEnd_m = 5.0;       // of a path that is kept, in addition to the way to stop
constexpr Duration kPathKept =
    from_seconds(1.5);  // validity of a path that the search did not confirm

/// Rise of an axis of the vehicle above level.
double rise(const Pose& T, const Vec3& axis_vehicle) {
  return std::asin(std::clamp((T.q * axis_vehicle).z(), -1.0, 1.0));
}

double heading(const Pose& T) {
  const Vec3 ahead = T.q * Vec3::UnitX();
  return std::atan2(ahead.y(), ahead.x());
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

BgNode::BgNode(const BgConfig& config, Bus* bus, StopLatch latch, bool supervised)
    : config_(config),
      clock_(config.period),
      plan_clock_(config.plan_period),
      subordinate_(bus, config.info.name, channel::kBgCommand, channel::kBgStop, channel::kBgStatus,
                   {}),
      inputs_(bus, supervised),
      drive_(config, bus),
      plan_out_(bus, channel::kBgPlan),
      report_(bus, config.info.name, kReportInterval),
      hidden_(config.sight),
      unverified_(config.sight, config.shape),
      zones_(config.zones, config.shape, bus),
      required_(config.shape.min_margin_m),
      planner_(config.search, config.shape, config.weights, config.near_goal_m),
      route_(config.north_m),
      emergency_stop_(std::move(latch), config.release_authorities) {
  path_.reserve(4096);
  candidate_.reserve(4096);
  way_back_.reserve(kMaxWaypoints);
}

std::vector<const InboxBase*> BgNode::inboxes() const {
  std::vector<const InboxBase*> all = {&subordinate_.inbox(), &subordinate_.stop_inbox()};
  for (const InboxBase* inbox : inputs_.inboxes()) all.push_back(inbox);
  if (zones_.inbox() != nullptr) all.push_back(zones_.inbox());
  return all;
}

Duration BgNode::nominal_compute() const {
  const bool plans = clock_.next() >= plan_clock_.next();
  return plans ? config_.plan_compute : config_.info.nominal_compute;
}

void BgNode::run(const Cycle& cycle) {
  // The superior of a release learns its result before another command is in force.
  subordinate_.take(cycle.now, emergency_stop_.releasing());
  emergency_stop_.engage(subordinate_.stops(), cycle.now, &report_);
  if (emergency_stop_.engaged()) subordinate_.end_tasks();
  take_command();
  take_nav(cycle);
  inputs_.take(cycle.now, &report_);
  zones_.update(nav_, inputs_.integrity(), !route_.knows_north(nav_), cycle.now);
  check_zones();
  take_map(cycle);
  if (map_is_of_now()) {
    required_.moved(clearance(), std::abs(nav_.speed_mps) < config_.decide.rest_mps);
  }
  route_.pass(nav_, place());
  cycle.stages->mark("receive");

  Facts now = facts(cycle.now);
  back_out(cycle.now, now);
  if (plan_clock_.due(cycle.now)) {
    plan(cycle, now);
    plan_clock_.advance(cycle.now);
    now = facts(cycle.now);
  }
  cycle.stages->mark("plan");

  Decision decision = decide(now, emergency_stop_.engaged(), config_.decide);
  drive(cycle, decision);
  emergency_stop_.update(subordinate_.command(), cycle.now, &report_, &decision);
  subordinate_.release_stops(emergency_stop_.take_released());
  publish_status(decision, cycle.now);
  cycle.stages->mark("drive");
  if (clock_.due(cycle.now)) clock_.advance(cycle.now);
  cycle.stages->close_account();
}

void BgNode::take_command() {
  if (!subordinate_.is_new()) return;
  const command_t& m = *subordinate_.command();
  const int before = route_.route().number();
  cannot_ = "";
  zones_unchecked_ = true;
  if (kind_of(m) == CommandKind::kGoto) {
    cannot_ = route_.take(m);
  } else {
    route_.clear();
  }
  if (route_.route().number() == before) return;
  planner_.begin_task();
  leads_back_ = leaves_obstacle_ = false;
  way_back_watch_.begin();
  route_.begin();
  path_.clear();
  path_since_ = Stamp::min();
}

// The position of a waypoint in frame world is known from the first pose there on.
void BgNode::check_zones() {
  if (!zones_unchecked_ || !nav_.world_valid || !nav_.pose_valid) return;
  zones_unchecked_ = false;
  if (cannot_.empty()) cannot_ = zones_.objection(route_.route(), nav_);
}

void BgNode::take_nav(const Cycle& cycle) {
  Inbox<nav_state_t>& states = inputs_.nav_states();
  for (; !states.empty(); states.pop()) {
    const nav_state_t& m = *states.front();
    const Stamp before = nav_.stamp;
    const bool first = nav_.arrival == Stamp::min();
    if (!read_nav(m, states.front_arrival(), &nav_)) {
      report_.publish(cycle.now, event::kBgInputRejected, "{} rejected: pose or velocity invalid",
                      channel::kWmNavState);
      continue;
    }
    if (first || nav_.stamp != before) nav_moved_ = nav_.arrival;
    leave_trail();
    route_.note_datum(nav_);
    latency_trace_t& trace = drive_.latency_trace();
    if (m.latency_trace.measured_utime != trace.measured_utime) {
      trace = m.latency_trace;
      trace.bg_arrival_utime = to_utime(nav_.arrival);
      trace.bg_start_utime = to_utime(cycle.now);
    }
  }
}

void BgNode::take_map(const Cycle& cycle) {
  const map_patch_t* const m = inputs_.map_patches().latest();
  if (m == nullptr) return;
  if (read_terrain(*m, &terrain_)) {
    const bool other_frame = terrain_local_utime_ != m->local_utime;
    if (other_frame) {
      hidden_.clear();
      planner_.forget();
    }
    const Stamp scan = from_utime(m->utime);
    const Scans scans = scan_watch_.update(scan, nav_.stamp);
    const bool in_frame = trail_local_utime_ == m->local_utime;
    const double before_m = clearance();
    if (in_frame) {
      trail_.mark(config_.shape, &terrain_);
      if (route_.route().map_epoch()) {
        // Before the marks of what is hidden, unverified or forbidden, which remain.
        route_.way_back(nav_, config_.search.horizon_m, &way_back_);
        mark_way_back(way_back_, config_.shape, config_.weights, &terrain_);
      }
      const Pose& T = nav_.T_local_vehicle;
      hidden_.mark(place(), rise(T, Vec3::UnitX()), rise(T, Vec3::UnitY()), scans == Scans::kNew,
                   &terrain_);
      unverified_.mark(place(), scans, &terrain_);
    }
    terrain_stamp_ = scan;
    terrain_local_utime_ = m->local_utime;
    // Now, and not with the next plan: the free way is limited in every cycle.
    obstacles_.compute(terrain_, config_.weights);
    if (in_frame) {
      planner_.note(place(), terrain_, obstacles_);
      zones_.mark(place(), &terrain_);
      if (zones_.forbids()) obstacles_.compute(terrain_, config_.weights);
    } else {
      zones_.unmark();
    }
    if (other_frame) {
      required_.begin(clearance());
    } else {
      required_.map_changed(before_m, clearance());
    }
  } else {
    report_.publish(cycle.now, event::kBgInputRejected,
                    "{} rejected: terrain of {} x {} cells of {} m invalid", channel::kWmMapPatch,
                    m->width, m->height, m->cell_m);
  }
  inputs_.map_patches().pop();
}

void BgNode::leave_trail() {
  if (trail_local_utime_ != nav_.local_utime) {
    trail_.move_to_frame_of(place());
    unverified_.move_to_frame_of(place());
  }
  trail_local_utime_ = nav_.local_utime;
  trail_.add(place());
}

bool BgNode::map_is_of_now() const {
  return terrain_.width > 0 && terrain_local_utime_ == nav_.local_utime;
}

double BgNode::clearance() const { return planner_.body().clearance(obstacles_, place()); }

Pose2d BgNode::place() const {
  return {nav_.T_local_vehicle.p.x(), nav_.T_local_vehicle.p.y(), heading(nav_.T_local_vehicle),
          drive_.curvature_1pm()};
}

WayBackWatch::Along BgNode::plan_way_back(double speed_mps, Stamp now) {
  route_.way_back(nav_, config_.search.horizon_m, &way_back_);
  follow_way_back(way_back_, place(), config_.shape, config_.search.horizon_m, &candidate_);
  if (candidate_.empty()) {
    way_back_watch_.off();
    return WayBackWatch::Along::kNo;
  }
  cut_at_obstacles(0, &candidate_);
  const WayBackWatch::Ahead ahead{
      candidate_.back().s_m, route_.ends_at(candidate_.back().place, nav_),
      stopping_m(speed_mps, config_.follow) + kBeforeObstacle_m, long_enough_m(speed_mps)};
  return way_back_watch_.on(ahead, place(), now);
}

Facts BgNode::facts(Stamp now) const {
  Facts f;
  const command_t* const command = subordinate_.command();
  if (command != nullptr) {
    f.command = kind_of(*command);
    f.command_is_new = subordinate_.is_new();
    f.command_is_valid = subordinate_.valid(now);
    f.cannot = subordinate_.task_ended()
                   ? "command rejected: an emergency stop has ended its task; give a new command"
               : route_.in_other_world()
                   ? "command rejected: WM has begun another frame world with another datum"
               : route_.in_other_map(nav_) ? "command rejected: SP has begun another rolling map"
                                           : cannot_;
  }
  f.supervisor_silent = inputs_.supervisor_silent(now);
  if (nav_.arrival == Stamp::min()) return f;
  f.nav_age = now - nav_.arrival;
  f.nav_still = now - nav_moved_;
  f.speed_mps = nav_.speed_mps;
  f.pose_valid = nav_.pose_valid && inputs_.integrity().pose_valid;
  f.second_publisher = inputs_.second_publisher(now);
  const Stamp integrity = inputs_.integrity().arrival;
  if (integrity != Stamp::min()) f.integrity_age = now - integrity;
  f.ins_age = nav_.ins_age;
  f.aligned = nav_.aligned;
  f.ladar_age = nav_.ladar_age;
  f.gps_age = nav_.gps_age;
  if (map_is_of_now()) f.map_age = std::max(Duration(0), nav_.stamp - terrain_stamp_);
  f.north_known = route_.knows_north(nav_);
  f.speed_share = speed_share();
  f.arrived = f.command == CommandKind::kGoto && cannot_.empty() && route_.route().arrived();
  f.has_path = !path_.empty() && path_local_utime_ == nav_.local_utime &&
               now - path_since_ <= kPathKept &&
               std::abs(steering_.off_m) <= config_.follow.max_lateral_deviation_m;
  f.leads_back = leads_back_;
  zones_.describe(path_, at_, &f);
  f.without_path = path_since_ == Stamp::min() ? Duration(0) : now - path_since_;
  const Stamp enclosed = planner_.enclosed_since();
  if (enclosed != Stamp::max() && now - enclosed > config_.decide.patience) {
    f.has_path = false;
    f.without_path = now - enclosed;
  }
  return f;
}

/// A task in frame local does not depend on the world pose but on that in the rolling map.
double BgNode::speed_share() const {
  if (route_.route().in_world() && !nav_.world_valid) return 1.0;
  vj::SpeedParams speeds = config_.speeds;
  if (const command_t* const c = subordinate_.command(); c != nullptr) {
    // A task can have a narrower limit than the vehicle, not a wider one.
    const auto narrow = [](double asked_m, double* limit_m) {
      if (asked_m > 0.0) *limit_m = std::min(*limit_m, asked_m);
    };
    narrow(c->alert_limit_horizontal_m, &speeds.alert_limit_horizontal_m);
    narrow(c->alert_limit_vertical_m, &speeds.alert_limit_vertical_m);
  }
  if (!route_.route().in_world()) {
    return vj::protected_share(nav_.local.horizontal_m, nav_.local.vertical_m, speeds);
  }
  return std::min(vj::speed_share(nav_.sigma_world_m, speeds),
                  vj::protected_share(inputs_.integrity().horizontal_m,
                                      inputs_.integrity().vertical_m, speeds));
}

void BgNode::plan(const Cycle& cycle, const Facts& now) {
  const bool on_the_way = now.command == CommandKind::kGoto && now.cannot.empty() && !now.arrived &&
                          now.nav_age <= config_.decide.nav_silence && now.pose_valid &&
                          now.nav_still <= config_.decide.nav_still && now.aligned &&
                          now.speed_share > 0.0 && map_is_of_now() && !emergency_stop_.engaged();
  if (!on_the_way || leads_back_) return;
  if (path_since_ == Stamp::min()) path_since_ = cycle.now;  // the search begins now
  const Planner::Query query{
      terrain_,
      obstacles_,
      start(now.speed_mps),
      route_.goal(nav_, place()),
      route_.onward_goal(nav_),
      [this] { return zones_.forbidden(planner_.remembered(), planner_.body().radius_m()); }};
  const bool back = plan_way_back(now.speed_mps, cycle.now) != WayBackWatch::Along::kNo;
  if (back) {
    found_ = {SearchStop::kHorizon, candidate_.back().s_m, 0};
  } else {
    found_ =
        planner_.plan(query, cycle.now, static_cast<int>(grant(cycle, config_.grant)), &candidate_);
  }
  const double max_mps =
      std::min({config_.max_speed_mps, route_.route().next().speed_mps,
                route_.knows_north(nav_) ? config_.max_speed_mps : config_.north_mps});
  // Two paths around an obstacle cost about the same, and the cheaper one changes from scan to
  // scan: the current path is kept while it is free, long enough and not clearly more expensive.
  const double rest_m = path_.empty() ? 0.0 : path_.back().s_m - path_[at_].s_m;
  const bool under_way = now.has_path && !back && rest_m > long_enough_m(now.speed_mps) &&
                         path_local_utime_ == nav_.local_utime;
  const bool keep =
      under_way && candidate_.size() > 1 &&
      planner_.cost_of_rest(query, path_, at_) < config_.follow.keep_cost * found_.cost;
  if (keep) {
    path_since_ = cycle.now;
  } else if (candidate_.size() > 1 || back) {
    std::swap(path_, candidate_);
    at_ = 0;
    steering_ = {};
    path_since_ = cycle.now;
    path_local_utime_ = nav_.local_utime;
  } else {
    // The last path is followed a little longer, as far as it is free: a search that begins at
    // speed has fewer solutions than one that begins after some braking.
    report_.publish(
        cycle.now, event::kBgPathNone,
        "no path to waypoint {} of {}, distance {:.1f} m: following the last path while free",
        route_.route().done() + 1, route_.route().size(),
        std::hypot(query.to.x_m - place().x_m, query.to.y_m - place().y_m));
    if (path_local_utime_ != nav_.local_utime) path_.clear();
    cut_at_obstacles(at_, &path_);
    if (path_.size() < 2) return;
  }
  zones_.limit_speeds(&path_);
  plan_speeds(terrain_, config_.weights, config_.speeds, config_.follow, config_.shape, max_mps,
              now.speed_share, &path_);
  publish_plan(cycle.now);
}

// The scans arrive, but a wall that fills the view does not determine the pose: at rest that does
// not change. Or the vehicle has braked too late, and stands with its outline in an obstacle: a
// path that begins there would lead over it. The ground that the vehicle has just driven over is
// free.
void BgNode::back_out(Stamp now, const Facts& facts) {
  const bool at_rest = std::abs(facts.speed_mps) < config_.decide.rest_mps;
  if (leads_back_) {
    path_since_ = now;
    const bool out = leaves_obstacle_ && clearance() >= config_.shape.min_margin_m;
    // A pose that was corrected meanwhile may have moved the vehicle off that path.
    const bool off = std::abs(steering_.off_m) > config_.follow.max_lateral_deviation_m;
    leads_back_ = !path_.empty() && path_local_utime_ == nav_.local_utime && !out && !off &&
                  !(steering_.at_end && at_rest) && facts.map_age <= config_.decide.map_loss;
    if (leads_back_) return;
    leaves_obstacle_ = false;
    path_.clear();
    return;
  }
  const bool may_back = facts.command == CommandKind::kGoto && at_rest &&
                        facts.map_age <= config_.decide.map_loss && map_is_of_now();
  if (may_back && !facts.has_path && facts.without_path > kStuck && clearance() < -kInside_m) {
    lead_back(facts);
    leaves_obstacle_ = leads_back_;
    return;
  }
  if (!may_back || facts.ladar_age <= config_.decide.ladar_loss) {
    unregistered_since_ = Stamp::max();
  } else if (unregistered_since_ == Stamp::max()) {
    unregistered_since_ = now;
  } else if (now - unregistered_since_ > kUnregistered) {
    lead_back(facts);
    unregistered_since_ = Stamp::max();
  }
}

void BgNode::lead_back(const Facts& facts) {
  trail_.lead_back(kLeadBack_m, &path_);
  for (PathPoint& p : path_) p.clearance_m = planner_.body().clearance(obstacles_, p.place);
  plan_speeds(terrain_, config_.weights, config_.speeds, config_.follow, config_.shape,
              config_.max_speed_mps, facts.speed_share, &path_);
  leads_back_ = !path_.empty();
  path_local_utime_ = nav_.local_utime;
  at_ = 0;
  steering_ = {};
}

Start BgNode::start(double speed_mps) const {
  const int direction = speed_mps > config_.decide.rest_mps    ? 1
                        : speed_mps < -config_.decide.rest_mps ? -1
                                                               : 0;
  // Backwards the vehicle is slow and on known ground. If every path that begins backwards had to
  // continue so for the stopping distance, new paths would lead it back for ever.
  const double stop_m = direction > 0 ? stopping_m(speed_mps, config_.follow) : 0.0;
  return {place(), direction, stop_m, required_.of(clearance())};
}

void BgNode::cut_at_obstacles(std::size_t at, Path* path) const {
  const double required_m = required_.of(clearance());
  for (std::size_t k = at; k < path->size(); ++k) {
    PathPoint& p = (*path)[k];
    p.clearance_m = planner_.body().clearance(obstacles_, p.place);
    if (p.clearance_m < required_m && k > at + 1) {
      path->resize(k);
      return;
    }
  }
}

void BgNode::drive(const Cycle& cycle, const Decision& decision) {
  const bool knows_path = !path_.empty() && path_local_utime_ == nav_.local_utime;
  // What the outline stands in is no obstacle on the way out of it.
  const double required_m = leaves_obstacle_ ? -kAnywhere_m : required_.of(clearance());
  drive_.compute(decision,
                 {nav_, place(), planner_.body(), obstacles_, map_is_of_now(), required_m,
                  route_.route().map_epoch().has_value()},
                 knows_path ? &path_ : nullptr, &at_, &steering_, cycle.now, &report_);
  leave_way_if_held(cycle.now, drive_.is_held());
  drive_.publish(emergency_stop_.engaged(), cycle.now);
}

void BgNode::leave_way_if_held(Stamp now, bool held) {
  if (std::hypot(place().x_m - held_at_.x_m, place().y_m - held_at_.y_m) > kFreed_m) {
    planner_.release();
  }
  if (!held) {
    held_since_ = Stamp::max();
  } else if (held_since_ == Stamp::max()) {
    held_since_ = now;
  } else if (now - held_since_ > kHeld && !path_.empty()) {
    report_.publish(
        now, event::kBgPathBlocked,
        "path of {:.1f} m dropped: vehicle at rest for {:.1f} s, blocked by a nearby obstacle",
        path_.back().s_m, seconds(now - held_since_));
    planner_.bar(path_);
    if (way_back_watch_.keeps()) way_back_watch_.leave(place());
    path_.clear();
    held_at_ = place();
    held_since_ = Stamp::max();
  }
}

// Near its end a path is slow: the vehicle must be able to stop there.
double BgNode::long_enough_m(double speed_mps) const {
  return std::max(config_.follow.keep_m, stopping_m(speed_mps, config_.follow) + kBeforeEnd_m);
}

void BgNode::publish_plan(Stamp now) {
  plan_.utime = to_utime(now);
  plan_.issuer = subordinate_.command()->issuer;
  plan_.serial = subordinate_.command()->serial;
  plan_.cost = found_.cost;
  write_plan(path_, terrain_, nav_.T_local_vehicle.p.z(), now, &plan_);
  plan_out_.publish(&plan_);
}

void BgNode::publish_status(const Decision& decision, Stamp now) {
  StatusReport status{message_status(decision.status),
                      decision.state,
                      decision.line,
                      decision.reason,
                      0,
                      route_.route().done()};
  emergency_stop_.describe(&status);
  subordinate_.report(now, status);
  if (decision.state == reported_state_) return;
  report_.publish(now, event::kBgState, "{} -> {}{}{}",
                  reported_state_.empty() ? std::string_view("start") : reported_state_,
                  decision.state, decision.reason.empty() ? "" : ": ", decision.reason);
  reported_state_ = decision.state;
}

Result<std::unique_ptr<Node>> make_bg_node(const ParamFile& file, Bus* bus) {
  const Result<BgConfig> config = load_bg_config(file);
  if (!config) return config.error();
  return std::unique_ptr<Node>(std::make_unique<BgNode>(*config, bus, StopLatch()));
}

Result<std::unique_ptr<Node>> make_live_bg_node(const ParamFile& file, Bus* bus) {
  const Result<BgConfig> config = load_bg_config(file);
  if (!config) return config.error();
  Result<StopLatch> latch = open_stop_latch(file);
  if (!latch) return latch.error();
  latch->use(std::make_unique<StopWriterThread>());
  return std::unique_ptr<Node>(
      std::make_unique<BgNode>(*config, bus, std::move(latch).value(), is_supervised()));
}

}  // namespace rcs::bg

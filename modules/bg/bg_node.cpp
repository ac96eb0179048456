#include "modules/bg/bg_node.h"

#include <algorithm>
#include <cmath>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"

namespace rcs::bg {
namespace {

constexpr Duration kReportInterval = from_seconds(5.0);
constexpr int kMostWaypoints = 64;
constexpr double kFarthest_m = 1e6;
constexpr int kMostCells = 1024 * 1024;
constexpr Duration kWayKept = from_seconds(1.5);  // a path that was not found anew is used so long

Order order_of(const command_t& m) {
  switch (m.kind) {
    case command_t::KIND_HALT:
    case command_t::KIND_ABORT:
      return Order::kHalt;
    case command_t::KIND_GOTO:
      return Order::kGoto;
    case command_t::KIND_EMERGENCY_STOP:
      return Order::kEmergencyStop;
    case command_t::KIND_RELEASE:
      return Order::kRelease;
    default:
      return Order::kUnknown;
  }
}

/// Why a GOTO's content cannot be done; empty: it can.
std::string_view objection(const command_t& m) {
  if (m.frame != command_t::FRAME_WORLD && m.frame != command_t::FRAME_LOCAL) {
    return "cannot do because the waypoints' frame is unknown";
  }
  if (m.n < 1 || m.n > kMostWaypoints) return "cannot do because there must be 1 to 64 waypoints";
  for (const waypoint_t& w : m.waypoint) {
    const Vec3 p = from_message(w.p_m);
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > kFarthest_m) {
      return "cannot do because a waypoint is not finite or farther than 1000 km";
    }
    if (!(w.radius_m >= 0.5 && w.radius_m <= 50.0)) {
      return "cannot do because a waypoint's radius is not 0.5 to 50 m";
    }
    if (!(w.speed_mps > 0.0 && w.speed_mps <= 30.0)) {
      return "cannot do because a waypoint's speed is not above 0 and up to 30 m/s";
    }
  }
  return "";
}

bool same(const std::vector<waypoint_t>& a, const std::vector<waypoint_t>& b) {
  return a.size() == b.size() &&
         std::equal(a.begin(), a.end(), b.begin(), [](const waypoint_t& x, const waypoint_t& y) {
           return std::equal(std::begin(x.p_m), std::end(x.p_m), std::begin(y.p_m)) &&
                  x.radius_m == y.radius_m && x.speed_mps == y.speed_mps;
         });
}

double heading(const Pose& T) {
  const Vec3 ahead = T.q * Vec3::UnitX();
  return std::atan2(ahead.y(), ahead.x());
}

Duration sum(std::int64_t age_us, Duration more) {
  constexpr std::int64_t kCentury_us = 3'000'000'000'000'000;
  if (age_us < 0 || age_us > kCentury_us || more == Duration::max()) return Duration::max();
  return Duration(age_us) + more;
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

BgNode::BgNode(const BgConfig& config, Bus* bus)
    : config_(config),
      clock_(config.period),
      plan_clock_(config.plan_period),
      subordinate_(bus, config.info.name, channel::kBgCommand, channel::kBgStatus, {}),
      nav_states_(bus, channel::kWmNavState, 8),
      map_patches_(bus, channel::kWmMapPatch, 1),
      drive_out_(bus, channel::kBgDrive),
      plan_out_(bus, channel::kBgPlan),
      report_(bus, config.info.name, kReportInterval),
      search_(config.search, config.shape, config.weights) {
  path_.reserve(4096);
  candidate_.reserve(4096);
  route_.reserve(kMostWaypoints);
}

std::vector<const InboxBase*> BgNode::inboxes() const {
  return {&subordinate_.inbox(), &nav_states_, &map_patches_};
}

Duration BgNode::nominal_compute() const {
  const bool plans = clock_.next() >= plan_clock_.next();
  return plans ? config_.plan_compute : config_.info.nominal_compute;
}

void BgNode::run(const Cycle& cycle) {
  subordinate_.take(cycle.now);
  take_command();
  take_nav(cycle);
  take_map(cycle);
  pass_waypoints();
  cycle.stages->mark("take");

  Facts now = facts(cycle.now);
  if (plan_clock_.due(cycle.now)) {
    plan(cycle, now);
    plan_clock_.advance(cycle.now);
    now = facts(cycle.now);
  }
  cycle.stages->mark("plan");

  const Decision decision = decide(now, emergency_, config_.decide);
  emergency_ = decision.emergency;
  drive(cycle, decision);
  publish_status(decision, cycle.now);
  cycle.stages->mark("drive");
  if (clock_.due(cycle.now)) clock_.advance(cycle.now);
  cycle.stages->close_account();
}

// A command that asks for the same again, as a superior does to stay in charge, changes nothing on
// the way.
void BgNode::take_command() {
  if (!subordinate_.is_new()) return;
  const command_t& m = *subordinate_.command();
  cannot_ = "";
  if (order_of(m) != Order::kGoto) {
    route_.clear();
    path_.clear();
    return;
  }
  cannot_ = objection(m);
  if (!cannot_.empty()) {
    route_.clear();
    path_.clear();
    return;
  }
  if (m.frame == route_frame_ && same(m.waypoint, route_)) return;
  route_ = m.waypoint;
  route_frame_ = m.frame;
  next_waypoint_ = 0;
  ahead_.reset();
  path_.clear();
  way_since_ = Stamp::min();
}

void BgNode::take_nav(const Cycle& cycle) {
  for (; !nav_states_.empty(); nav_states_.pop()) {
    const nav_state_t& m = *nav_states_.front();
    Nav n;
    n.stamp = from_utime(m.utime);
    n.arrival = nav_states_.front_arrival();
    n.local_utime = m.local_utime;
    const bool good = from_message(m.q_local_vehicle, m.p_local_vehicle_m, &n.T_local_vehicle) &&
                      from_message(m.q_world_vehicle, m.p_world_vehicle_m, &n.T_world_vehicle) &&
                      from_message(m.v_world_mps).allFinite();
    if (!good) {
      report_.warn(cycle.now, "input.refused", "{}: a pose or velocity that is none",
                   channel::kWmNavState);
      continue;
    }
    n.world_valid = m.world_valid != 0;
    n.aligned = m.mode != nav_state_t::MODE_ALIGN && m.mode != nav_state_t::MODE_LOST;
    n.speed_mps = (n.T_world_vehicle.q.conjugate() * from_message(m.v_world_mps)).x();
    const auto sigma = [](const double(&c)[6][6]) {
      return std::sqrt(std::max({0.0, c[0][0], c[1][1]}));
    };
    n.sigma_world_m = sigma(m.cov_world_pose);
    n.ladar_age = sum(m.age_rolling_us, Duration(0));
    n.gps_age = sum(m.age_gps_us, Duration(0));
    nav_ = n;
    if (m.ledger.measured_utime != drive_.ledger.measured_utime) {
      drive_.ledger = m.ledger;
      drive_.ledger.bg_arrival_utime = to_utime(n.arrival);
      drive_.ledger.bg_start_utime = to_utime(cycle.now);
    }
  }
}

void BgNode::take_map(const Cycle& cycle) {
  const map_patch_t* const m = map_patches_.latest();
  if (m == nullptr) return;
  const std::size_t cells = m->n > 0 ? static_cast<std::size_t>(m->n) : 0;
  const bool good = m->cell_m >= 0.05 && m->cell_m <= 10.0 && m->width > 0 && m->height > 0 &&
                    m->width <= 1024 && m->height <= 1024 && m->n <= kMostCells &&
                    m->width * m->height == m->n && std::abs(m->first_i) < 100'000'000 &&
                    std::abs(m->first_j) < 100'000'000 && std::abs(m->base_m) < kFarthest_m;
  if (!good) {
    report_.warn(cycle.now, "input.refused", "{}: {} x {} cells of {} m are no terrain",
                 channel::kWmMapPatch, m->width, m->height, m->cell_m);
    map_patches_.pop();
    return;
  }
  terrain_.cell_m = m->cell_m;
  terrain_.first = {m->first_i, m->first_j};
  terrain_.width = m->width;
  terrain_.height = m->height;
  terrain_.ground.resize(cells);
  for (std::size_t k = 0; k < cells; ++k) {
    vj::Ground& g = terrain_.ground[k];
    const std::uint8_t flags = m->flags[k];
    g.known = (flags & map_patch_t::FLAG_UNKNOWN) == 0;
    g.obstacle = (flags & map_patch_t::FLAG_OBSTACLE) != 0;
    g.height_m = static_cast<float>(m->base_m) + 0.01F * m->height_cm[k];
    g.step_m = 0.01F * m->step_cm[k];
    g.slope_rad = static_cast<float>(radians(m->slope_deg[k]));
    g.roughness_m = 0.01F * m->roughness_cm[k];
  }
  terrain_stamp_ = from_utime(m->utime);
  terrain_local_utime_ = m->local_utime;
  map_patches_.pop();
}

bool BgNode::map_is_of_now() const {
  return terrain_.width > 0 && terrain_local_utime_ == nav_.local_utime;
}

Place BgNode::place() const {
  return {nav_.T_local_vehicle.p.x(), nav_.T_local_vehicle.p.y(), heading(nav_.T_local_vehicle),
          drive_.curvature_1pm};
}

// The next waypoint in frame local. A waypoint in frame world moves there as WM learns better where
// the vehicle is.
Goal BgNode::goal() {
  if (!knows_north()) {
    if (!ahead_) {
      const Place end =
          along_arc({place().x_m, place().y_m, place().heading_rad, 0.0}, config_.north_m);
      ahead_ = Goal{end.x_m, end.y_m, 3.0};
    }
    return *ahead_;
  }
  const waypoint_t& w = route_[next_waypoint_];
  Vec3 p = from_message(w.p_m);
  if (route_frame_ == command_t::FRAME_WORLD) {
    p = nav_.T_local_vehicle * (nav_.T_world_vehicle.inverse() * p);
  }
  // Truly within the circle, not only by a belief that is off by some sigmas.
  const double sigma_m = route_frame_ == command_t::FRAME_WORLD ? nav_.sigma_world_m : 0.0;
  return {p.x(), p.y(), std::max(0.5 * w.radius_m, w.radius_m - 2.0 * sigma_m)};
}

void BgNode::pass_waypoints() {
  if (nav_.arrival == Stamp::min()) return;
  if (!knows_north()) return;
  while (next_waypoint_ < route_.size()) {
    const Goal g = goal();
    const Place here = place();
    if (std::hypot(g.x_m - here.x_m, g.y_m - here.y_m) > g.radius_m) return;
    ++next_waypoint_;
  }
}

Facts BgNode::facts(Stamp now) const {
  Facts f;
  const command_t* const command = subordinate_.command();
  if (command != nullptr) {
    f.order = order_of(*command);
    f.order_is_valid = subordinate_.valid(now);
    f.cannot = cannot_;
  }
  if (nav_.arrival == Stamp::min()) return f;
  f.nav_age = now - nav_.arrival;
  f.speed_mps = nav_.speed_mps;
  f.aligned = nav_.aligned;
  f.ladar_age = nav_.ladar_age;
  f.gps_age = nav_.gps_age;
  if (map_is_of_now()) f.map_age = std::max(Duration(0), nav_.stamp - terrain_stamp_);
  f.north_known = knows_north();
  const bool world = route_frame_ == command_t::FRAME_WORLD && nav_.world_valid;
  // Frame local is where it is: nothing to be unsure of.
  f.speed_share = vj::speed_share(world ? nav_.sigma_world_m : 0.0, config_.speeds);
  f.arrived = f.order == Order::kGoto && cannot_.empty() && next_waypoint_ >= route_.size();
  f.has_way = !path_.empty() && path_local_utime_ == nav_.local_utime &&
              now - way_since_ <= kWayKept && std::abs(steering_.off_m) <= config_.follow.astray_m;
  f.without_way = way_since_ == Stamp::min() ? Duration(0) : now - way_since_;
  return f;
}

void BgNode::plan(const Cycle& cycle, const Facts& now) {
  const bool on_the_way = now.order == Order::kGoto && now.cannot.empty() && !now.arrived &&
                          now.nav_age <= config_.decide.nav_silence && now.aligned &&
                          now.speed_share > 0.0 && map_is_of_now() && !emergency_;
  if (!on_the_way) return;
  if (way_since_ == Stamp::min()) way_since_ = cycle.now;  // from now on one is looked for
  const Goal to = goal();
  obstacles_.compute(terrain_, config_.weights);
  field_.compute(terrain_, obstacles_, to, config_.weights, config_.shape);
  const int direction = now.speed_mps > config_.decide.rest_mps    ? 1
                        : now.speed_mps < -config_.decide.rest_mps ? -1
                                                                   : 0;
  const int granted = static_cast<int>(grant(cycle, config_.grant));
  found_ =
      search_.search(terrain_, obstacles_, field_, place(), direction, to, granted, &candidate_);
  const double most_mps = std::min({config_.max_speed_mps, route_[next_waypoint_].speed_mps,
                                    knows_north() ? config_.max_speed_mps : config_.north_mps});
  // Two ways around an obstacle cost about the same, and which is cheaper changes with every scan:
  // the one under way is kept while it is free, long enough and not clearly worse.
  const double rest_m = path_.empty() ? 0.0 : path_.back().s_m - path_[at_].s_m;
  const bool under_way =
      now.has_way && rest_m > config_.follow.keep_m && path_local_utime_ == nav_.local_utime;
  const bool keep = under_way && candidate_.size() > 1 &&
                    search_.cost_of_rest(path_, at_, terrain_, obstacles_, field_) <
                        config_.follow.keep_cost * found_.cost;
  if (keep) {
    way_since_ = cycle.now;
  } else if (candidate_.size() > 1) {
    std::swap(path_, candidate_);
    at_ = 0;
    steering_ = {};
    way_since_ = cycle.now;
    path_local_utime_ = nav_.local_utime;
  } else {
    // The last way is driven on for a little, as far as it is still free: a search that begins at
    // speed has fewer ways out than one that begins after some braking.
    report_.warn(cycle.now, "way.none", "no way to waypoint {} of {}, {:.1f} m away",
                 next_waypoint_ + 1, route_.size(),
                 std::hypot(to.x_m - place().x_m, to.y_m - place().y_m));
    cut_at_obstacles();
    if (path_.size() < 2) return;
  }
  plan_speeds(terrain_, config_.weights, config_.speeds, config_.follow, config_.shape, most_mps,
              now.speed_share, &path_);
  publish_plan(cycle.now);
}

void BgNode::cut_at_obstacles() {
  if (path_local_utime_ != nav_.local_utime) path_.clear();
  for (std::size_t k = at_; k < path_.size(); ++k) {
    path_[k].clearance_m = search_.clearance(obstacles_, path_[k].place);
    if (path_[k].clearance_m < 0.0 && k > at_ + 1) {
      path_.resize(k);
      return;
    }
  }
}

void BgNode::drive(const Cycle& cycle, const Decision& decision) {
  drive_.utime = to_utime(cycle.now);
  drive_.valid_until_utime = to_utime(cycle.now + config_.drive_valid);
  drive_.speed_mps = 0.0;
  drive_.accel_limit_mps2 = config_.accel_mps2;
  drive_.brake = decision.action == Action::kBrake ? 1 : 0;
  const bool knows_path = !path_.empty() && path_local_utime_ == nav_.local_utime;
  if (decision.action != Action::kBrake && knows_path) {
    steering_ = follow(path_, place(), nav_.speed_mps, config_.follow, config_.shape, &at_);
    drive_.curvature_1pm = steering_.curvature_1pm;
    if (decision.action == Action::kDrive) drive_.speed_mps = steering_.speed_mps;
  }
  drive_out_.publish(&drive_);
}

void BgNode::publish_plan(Stamp now) {
  plan_.utime = to_utime(now);
  plan_.issuer = subordinate_.command()->issuer;
  plan_.serial = subordinate_.command()->serial;
  plan_.cost = found_.cost;
  plan_.n = static_cast<std::int32_t>(path_.size());
  plan_.point.resize(path_.size());
  double arrival_s = 0.0;
  for (std::size_t k = 0; k < path_.size(); ++k) {
    const PathPoint& p = path_[k];
    if (k > 0) arrival_s += (p.s_m - path_[k - 1].s_m) / std::max(0.3, p.speed_mps);
    plan_point_t& out = plan_.point[k];
    out.utime = to_utime(now + from_seconds(arrival_s));
    out.p_m[0] = p.place.x_m;
    out.p_m[1] = p.place.y_m;
    const Cell cell = terrain_.cell_at(p.place.x_m, p.place.y_m);
    const vj::Ground ground = terrain_.at(cell);
    out.p_m[2] = ground.known ? ground.height_m : nav_.T_local_vehicle.p.z();
    out.yaw_rad = p.place.heading_rad;
    out.speed_mps = p.direction * p.speed_mps;
  }
  plan_out_.publish(&plan_);
}

void BgNode::publish_status(const Decision& decision, Stamp now) {
  subordinate_.report(now, message_status(decision.status), decision.state, decision.line,
                      decision.reason, 0);
  if (decision.state == reported_state_) return;
  report_.info(now, "state", "{} -> {}{}{}", reported_state_, decision.state,
               decision.reason.empty() ? "" : ": ", decision.reason);
  reported_state_ = decision.state;
}

Result<std::unique_ptr<Node>> make_bg_node(const ParamFile& file, Bus* bus) {
  const Result<BgConfig> config = load_bg_config(file);
  if (!config) return config.error();
  return std::unique_ptr<Node>(std::make_unique<BgNode>(*config, bus));
}

}  // namespace rcs::bg

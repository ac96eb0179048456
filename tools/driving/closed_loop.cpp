#include "tools/driving/closed_loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "modules/bg/bg_config.h"
#include "modules/bg/bg_node.h"
#include "modules/mission/mission_node.h"
#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/base/geodesy.h"
#include "rcs/node/bus/tap.h"
#include "rcs/node/command_port.h"
#include "rcs/node/executor.h"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "tools/driving/config_table.h"
#include "tools/driving/speed_notes.h"
#include "tools/mapping/map_writer.h"

namespace rcs::driving {
namespace {

/// Commands the waypoints of the course, and repeats the command every second until they are done;
/// then to return, if the level has a way back.
class Operator final : public Node {
 public:
  Operator(Bus* bus, Stamp begin, Level level)
      : port_(bus, level == Level::kBg ? channel::kBgCommand : channel::kMissionCommand,
              channel::kBgStop, level == Level::kBg ? channel::kBgStatus : channel::kMissionStatus,
              "operator", params(level)),
        begin_(begin),
        returns_(level == Level::kVisitReturn),
        // The mission node echoes once a second: a command must not be replaced before.
        each_(from_seconds(level == Level::kBg ? 1.0 : 4.0)) {}

  /// Not before there are waypoints.
  void ask(const Command& order) { order_ = order; }

  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return {&port_.inbox()}; }

  void run(const Cycle& cycle) override {
    clock_.advance(cycle.now);
    port_.step(cycle.now);
    if (cycle.now < begin_ || !order_) return;
    if (first_sent == Stamp::min()) first_sent = cycle.now;
    if (done_at == Stamp::max() && cycle.now >= next_send_) {
      order_->task = turned_at == Stamp::max() ? 1 : 2;
      order_->valid_for = 2 * each_ + each_ / 2;
      port_.send(*order_, cycle.now);
      next_send_ = cycle.now + each_;
    }
    const CommandProgress current = port_.progress(cycle.now);
    reason = current.reason;
    if (current.state == CommandProgress::State::kDone && returns_ && turned_at == Stamp::max()) {
      turned_at = cycle.now;
      order_->kind = command_t::KIND_RETURN;
      order_->waypoints.clear();
      next_send_ = cycle.now;
    } else if (current.state == CommandProgress::State::kDone) {
      done_at = std::min(done_at, cycle.now);
    }
    if (port_.status() != nullptr) state = port_.status()->state;
  }

  Stamp first_sent = Stamp::min();
  Stamp turned_at = Stamp::max();  ///< when the vehicle was commanded to return
  Stamp done_at = Stamp::max();
  std::string reason;
  std::string state;

 private:
  /// The mission node reports once a second.
  static CommandPortParams params(Level level) {
    CommandPortParams p;
    if (level != Level::kBg) p.silence = from_seconds(2.5);
    return p;
  }

  NodeInfo info_{"operator", from_milliseconds(50.0), from_milliseconds(0.1)};
  PeriodicClock clock_{from_milliseconds(200.0)};
  CommandPort port_;
  Stamp begin_;
  bool returns_;
  Duration each_;
  Stamp next_send_ = Stamp::min();
  std::optional<Command> order_;
};

/// The simulator, until the operator's command is done.
class UntilDone final : public EventSource {
 public:
  UntilDone(EventSource* source, const Operator* op, const ClosedLoopOptions& options,
            double duration_s)
      : source_(source), operator_(op), options_(options), duration_s_(duration_s) {}
  Stamp peek() override {
    const Stamp due = source_->peek();
    const Stamp done = operator_->done_at;
    const bool over = done != Stamp::max() && due > done + from_seconds(options_.after_done_s);
    return over || (options_.stop && options_.stop()) ? Stamp::max() : due;
  }
  void take(SourceEvent* event) override {
    if (options_.progress) {
      options_.progress(seconds(source_->peek() - sim::Simulator::kStart) / duration_s_);
    }
    source_->take(event);
  }

 private:
  EventSource* source_;
  const Operator* operator_;
  const ClosedLoopOptions& options_;
  double duration_s_;
};

std::string read_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

/// The vehicle's configuration with the scenario's datum, so that waypoints have the same meaning
/// for both.
std::string config_text(const sim::Scenario& scenario, const ClosedLoopOptions& options) {
  const auto number = [](double value) { return fmt::format("{:.12f}", value); };
  const auto quoted = [](const std::string& path) { return "\"" + path + "\""; };
  std::vector<std::pair<std::string, std::string>> keys = {
      {"datum_lat_deg", number(degrees(scenario.datum.lat_rad))},
      {"datum_lon_deg", number(degrees(scenario.datum.lon_rad))},
      {"datum_height_m", number(scenario.datum.height.m)}};
  if (!options.prior_map.empty()) keys.emplace_back("prior_map", quoted(options.prior_map));
  if (!options.zones.empty()) keys.emplace_back("zones", quoted(options.zones));
  const std::string text = with_keys(read_text(options.vehicle_config), "world", keys);
  return text + options.more_config;
}

Command goto_order(const sim::Scenario& scenario, const ClosedLoopOptions& options,
                   const Pose& T_frame_world) {
  Command order;
  order.kind = command_t::KIND_GOTO;
  order.frame = options.frame;
  order.alert_limit_horizontal_m = options.alert_limit_m;
  const std::vector<Vec2>& places = scenario.course.waypoints_world;
  for (std::size_t k = 1; k < places.size(); ++k) {
    waypoint_t w{};
    to_message(T_frame_world * Vec3(places[k].x(), places[k].y(), 0.0), w.p_m);
    w.radius_m = options.radius_m;
    w.speed_mps = scenario.course.speed_mps;
    order.waypoints.push_back(w);
  }
  return order;
}

/// How long a node was in each state.
class StateNotes {
 public:
  void accept(const status_t& m, std::map<std::string, double>* states_s) {
    const Stamp now = from_utime(m.utime);
    if (!state_.empty()) (*states_s)[state_] += seconds(now - at_);
    state_ = m.state;
    at_ = now;
  }

 private:
  std::string state_;
  Stamp at_{};
};

/// Everything that is recorded of a run.
class Notes {
 public:
  Notes(Bus* bus, const sim::Simulator& simulator, const sim::Scenario& scenario,
        const ClosedLoopOptions& options, Operator* op, ClosedLoopRun* run)
      : simulator_(simulator),
        scenario_(scenario),
        options_(options),
        operator_(op),
        run_(*run),
        world_(scenario.datum),
        truth_(bus, channel::kSimTruth, [this](const truth_t& m, Stamp) { accept(m); }),
        fixes_(bus, channel::kGpsFix,
               [this](const gps_fix_t& m, Stamp) { fix_ = from_utime(m.utime); }),
        nav_(bus, channel::kWmNavState, [this](const nav_state_t& m, Stamp) { accept(m); }),
        levels_(bus, channel::kWmIntegrity,
                [this](const integrity_t& m, Stamp) {
                  level_m_ =
                      m.validity == integrity_t::VALID_WORLD ? m.protection_horizontal_m : kNoLevel;
                }),
        states_(bus, channel::kBgStatus,
                [this](const status_t& m, Stamp) { bg_state_.accept(m, &run_.states_s); }),
        mission_states_(
            bus, channel::kMissionStatus,
            [this](const status_t& m, Stamp) { mission_state_.accept(m, &run_.mission_states_s); }),
        plans_(bus, channel::kBgPlan, [this](const plan_t& m, Stamp) { accept(m); }),
        routes_(bus, channel::kMissionRoutes,
                [this](const routes_t& m, Stamp) { run_.routes.push_back(m); }) {
    if (options.frame == command_t::FRAME_WORLD) op->ask(goto_order(scenario, options, Pose()));
  }

  [[nodiscard]] Stamp last() const { return sample_.stamp; }

 private:
  void accept(const truth_t& m) {
    Pose T;
    RCS_CHECK(from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T));
    const Vec2 v = from_message(m.v_world_mps).head<2>();
    const double since_s = received_ ? seconds(from_utime(m.utime) - sample_.stamp) : 0.0;
    if (received_) run_.distance_m += (T.p - sample_.T_world_vehicle.p).head<2>().norm();
    received_ = true;
    run_.worst_tilt_rad =
        std::max(run_.worst_tilt_rad, std::acos(std::clamp((T.q * Vec3::UnitZ()).z(), -1.0, 1.0)));
    sample_.stamp = from_utime(m.utime);
    sample_.T_world_vehicle = T;
    sample_.speed_mps = v.norm();
    sample_.clearance_m = m.clearance_m;
    sample_.gps = sample_.stamp - fix_ <= from_seconds(1.0);

    run_.collisions += m.clearance_m <= 0.0 && !collides_ ? 1 : 0;
    const auto with_actors = static_cast<int>(simulator_.actor_contacts().contacts().size());
    const int contacts = simulator_.contacts().total() + run_.collisions + with_actors;
    sample_.contact = sample_.contact || contacts > contacts_;
    contacts_ = contacts;
    collides_ = m.clearance_m <= 0.0;
    run_.foliage_contacts += m.foliage_contact != 0 && !touches_ ? 1 : 0;
    touches_ = m.foliage_contact != 0;
    run_.min_clearance_m = std::min(run_.min_clearance_m, m.clearance_m);
    run_.fastest_mps = std::max(run_.fastest_mps, sample_.speed_mps);
    run_.worst_lateral_mps2 =
        std::max(run_.worst_lateral_mps2, std::abs(sample_.speed_mps * m.rate_vehicle_radps[2]));
    for (std::size_t k = 0; k < run_.nearest_m.size(); ++k) {
      run_.nearest_m[k] =
          std::min(run_.nearest_m[k], (T.p.head<2>() - run_.waypoints_world[k]).norm());
    }
    const double error_m = (sample_.T_world_estimated.p - T.p).head<2>().norm();
    if (sample_.speed_mps > 0.5 && sample_.estimated) {
      run_.worst_error_m = std::max(run_.worst_error_m, error_m);
    }
    if (sample_.estimated && level_m_ < kNoLevel) {
      run_.bounded_s += since_s;
      if (error_m > level_m_) run_.outside_level_s += since_s;
    }
    if (m.seq % 10 != 0) return;
    run_.trace.push_back(sample_);
    sample_.contact = false;
  }

  void accept(const nav_state_t& m) {
    Pose T_local_vehicle, T_world_vehicle;
    RCS_CHECK(from_message(m.q_local_vehicle, m.p_local_vehicle_m, &T_local_vehicle));
    RCS_CHECK(from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T_world_vehicle));
    T_local_vehicle_ = T_local_vehicle;
    if (!received_) return;
    if (!sample_.estimated) {
      T_world_local_ = sample_.T_world_vehicle * T_local_vehicle.inverse();
      if (options_.frame == command_t::FRAME_LOCAL) {
        operator_->ask(goto_order(scenario_, options_, T_world_local_.inverse()));
      }
    }
    sample_.estimated = true;
    sample_.T_world_estimated = T_world_local_ * T_local_vehicle;
    if (m.world_valid == 0) return;
    sample_.T_world_estimated =
        world_.from(
            LocalFrame({radians(m.datum_lat_deg), radians(m.datum_lon_deg), {m.datum_height_m}})) *
        T_world_vehicle;
  }

  void accept(const plan_t& m) {
    const bool often =
        !run_.plans.empty() && from_utime(m.utime) - run_.plans.back().stamp < from_seconds(1.0);
    if (!received_ || m.n == 0 || often) return;
    const Pose T_world_local = sample_.T_world_vehicle * T_local_vehicle_.inverse();
    ClosedLoopPlan plan{from_utime(m.utime), {}};
    for (const plan_point_t& p : m.point) {
      plan.points_world.emplace_back((T_world_local * from_message(p.p_m)).head<2>());
    }
    run_.plans.push_back(std::move(plan));
  }

  static constexpr double kNoLevel = std::numeric_limits<double>::infinity();

  const sim::Simulator& simulator_;
  const sim::Scenario& scenario_;
  const ClosedLoopOptions& options_;
  Operator* operator_;
  ClosedLoopRun& run_;
  LocalFrame world_;
  double level_m_ = kNoLevel;
  StateNotes bg_state_;
  StateNotes mission_state_;
  ClosedLoopSample sample_;
  Stamp fix_ = Stamp(std::chrono::seconds(-10));
  Pose T_local_vehicle_;
  Pose T_world_local_;
  bool received_ = false;
  bool collides_ = false;
  int contacts_ = 0;
  bool touches_ = false;
  Tap<truth_t> truth_;
  Tap<gps_fix_t> fixes_;
  Tap<nav_state_t> nav_;
  Tap<integrity_t> levels_;
  Tap<status_t> states_;
  Tap<status_t> mission_states_;
  Tap<plan_t> plans_;
  Tap<routes_t> routes_;
};

WayBackOutcome way_back_of(const std::vector<ClosedLoopSample>& trace, Stamp turned_at) {
  WayBackOutcome out;
  const auto turn = std::find_if(trace.begin(), trace.end(),
                                 [&](const ClosedLoopSample& s) { return s.stamp >= turned_at; });
  if (turn == trace.begin() || turn == trace.end()) return out;
  const auto place = [](const ClosedLoopSample& s) { return Vec2(s.T_world_vehicle.p.head<2>()); };
  constexpr double kOnTheWay_m = 0.3;
  bool on_the_way = false;
  double squares = 0.0;
  int samples = 0;
  for (auto s = turn + 1; s != trace.end(); ++s) {
    const double step_m = (place(*s) - place(*(s - 1))).norm();
    out.length_m += step_m;
    if (s->speed_mps < 0.2) continue;  // a rest would count as often as its time
    double nearest = std::numeric_limits<double>::infinity();
    for (auto o = trace.begin(); o + 1 < turn; ++o) {
      const Vec2 d = place(*(o + 1)) - place(*o);
      const double t = d.squaredNorm() > 0.0
                           ? std::clamp((place(*s) - place(*o)).dot(d) / d.squaredNorm(), 0.0, 1.0)
                           : 0.0;
      nearest = std::min(nearest, (place(*s) - place(*o) - t * d).norm());
    }
    // It turns round beside the way first.
    on_the_way = on_the_way || nearest < kOnTheWay_m;
    if (!on_the_way) continue;
    squares += nearest * nearest;
    ++samples;
    out.lateral_max_m = std::max(out.lateral_max_m, nearest);
  }
  out.lateral_rms_m = samples > 0 ? std::sqrt(squares / samples) : 0.0;
  out.end_m = (place(trace.back()) - place(trace.front())).norm();
  return out;
}

void judge_zones(const std::string& file, const sim::Scenario& scenario, const bg::Shape& shape,
                 ClosedLoopRun* run) {
  const Result<GeodeticZones> drawn = load_zones(file);
  RCS_CHECK(drawn.ok());  // BG has been made with it
  const Zones zones = drawn->in_world(LocalFrame(scenario.datum));
  run->zones_world = zones.all();
  if (!zones.forbids()) return;
  ZoneJudge judge(zones, shape);
  for (const ClosedLoopSample& s : run->trace) judge.note(s.T_world_vehicle);
  run->zones = judge.outcome();
}

void conclude(const Operator& op, Stamp last, double radius_m, ClosedLoopRun* run) {
  run->done = op.done_at != Stamp::max();
  run->reason = run->done ? "" : op.reason;
  run->state = op.state;
  for (const double nearest_m : run->nearest_m) run->reached += nearest_m <= radius_m ? 1 : 0;
  if (op.first_sent == Stamp::min()) return;
  run->time_s = seconds((run->done ? op.done_at : last) - op.first_sent);
  run->mean_mps = run->distance_m / std::max(run->time_s, 1e-3);
}

}  // namespace

Result<std::unique_ptr<Node>> make_bg(const ParamFile& file, Bus* bus,
                                      const sim::Simulator& /*simulator*/) {
  return bg::make_bg_node(file, bus);
}

ClosedLoopRun run_closed_loop(const sim::Scenario& scenario, const ClosedLoopOptions& options,
                              const DriverFactory& make_driver) {
  RCS_CHECK(scenario.commanded);
  ClosedLoopRun run;
  const std::vector<Vec2>& places = scenario.course.waypoints_world;
  run.waypoints_world.assign(places.begin() + 1, places.end());
  run.nearest_m.assign(run.waypoints_world.size(), 1e9);

  sim::Simulator simulator(scenario);
  if (!options.prior_map.empty()) {
    const sim::PriorMap survey = simulator.prior_map();
    RCS_CHECK(mapping::write_map(options.prior_map, survey.frame, survey.raster).ok());
  }
  const Result<ParamFile> file =
      ParamFile::parse(config_text(scenario, options), options.vehicle_config);
  if (!file) {
    run.config_error = file.error().message;
    return run;
  }
  LocalBus bus;
  bus.set_tap(options.tap);
  simulator.listen(&bus, Duration(0));
  const Result<std::unique_ptr<Node>> sp = sp::make_sp_node(*file, &bus);
  const Result<std::unique_ptr<Node>> wm = wm::make_wm_node(*file, &bus);
  if (!sp || !wm) {
    run.config_error = sp ? wm.error().message : sp.error().message;
    return run;
  }
  const Result<std::unique_ptr<Node>> driver = make_driver(*file, &bus, simulator);
  if (!driver) {
    run.config_error = driver.error().message;
    return run;
  }
  const bool with_mission = options.level != Level::kBg;
  Result<std::unique_ptr<Node>> mission =
      with_mission ? mission::make_mission_node(*file, &bus) : std::unique_ptr<Node>();
  if (!mission) {
    run.config_error = mission.error().message;
    return run;
  }
  Operator op(&bus, sim::Simulator::kStart + from_seconds(scenario.course.rest_s), options.level);
  const Notes notes(&bus, simulator, scenario, options, &op, &run);
  std::optional<ActorNotes> actors;
  if (!scenario.actors.empty()) actors.emplace(&bus, simulator);

  const Result<bg::BgConfig> bg = bg::load_bg_config(*file);
  RCS_CHECK(bg.ok());  // BG has been made with it
  const AlertNotes alerts(&bus, options.frame, bg->speeds, scenario.course.speed_mps,
                          bg->follow.braking_mps2);

  const SpeedNotes speeds(&bus);
  const PredictionNotes predictions(&bus);

  WithLosses sensors(&simulator, options.losses);
  UntilDone source(&sensors, &op, options, scenario.duration_s);
  LockstepTimeline timeline(&bus, &source, kReplayTail);
  std::vector<Node*> nodes = {sp->get(), wm->get(), driver->get()};
  if (with_mission) nodes.push_back(mission->get());
  nodes.push_back(&op);
  rcs::run(nodes, timeline, nullptr);

  conclude(op, notes.last(), options.radius_m, &run);
  run.way_back = way_back_of(run.trace, op.turned_at);
  run.drive = simulator.commanded_vehicle()->model().account();
  run.fenced = simulator.commanded_vehicle()->fenced();
  run.contacts = simulator.contacts();
  if (actors) run.actors = actors->outcome();
  run.alerts = alerts.outcome();
  run.speed_limited_s = speeds.limited_s();
  run.predictions = predictions.outcome();
  run.losses = options.losses;
  if (!options.zones.empty()) judge_zones(options.zones, scenario, bg->shape, &run);
  return run;
}

std::string describe(const ClosedLoopRun& run) {
  if (!run.config_error.empty()) return run.config_error + "\n";
  std::string text = fmt::format(
      "{}: {} of {} waypoints, {:.0f} m in {:.1f} s ({:.1f} m/s, at most {:.1f}), lateral at most "
      "{:.1f} m/s2\n"
      "collisions {}, least clearance {:.2f} m, foliage contacts {}, position error at most "
      "{:.2f} m\n"
      "drive commands: {} accepted, {} implausible, {} stale, {} expired; {} silences{}\n",
      run.done ? "done" : "not done (" + run.state + ": " + run.reason + ")", run.reached,
      run.waypoints_world.size(), run.distance_m, run.time_s, run.mean_mps, run.fastest_mps,
      run.worst_lateral_mps2, run.collisions, run.min_clearance_m, run.foliage_contacts,
      run.worst_error_m, run.drive.taken, run.drive.implausible, run.drive.stale, run.drive.expired,
      run.drive.silences, run.fenced ? "; came to the border" : "");
  text += "nearest to the waypoints:";
  for (const double m : run.nearest_m) text += fmt::format(" {:.1f}", m);
  return text + " m\n";
}

}  // namespace rcs::driving

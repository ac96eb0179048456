#pragma once
// A world for BG with zones, in lockstep: a kinematic vehicle on level ground, whose frame local is
// turned and moved against frame world.

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <set>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "modules/bg/bg_node.h"
#include "rcs/node/executor.h"
#include "rcs/node/timeline/lockstep_timeline.h"

namespace rcs::bg::zone_world {

constexpr Stamp kStart = Stamp(std::chrono::seconds(1000));
constexpr Duration kStep = from_milliseconds(20.0);
constexpr Duration kPatch = from_milliseconds(200.0);
constexpr double kCell_m = 0.4;
constexpr int kSide = 150;  // cells
const Geodetic kDatum{radians(40.43), radians(-76.57), {150.0}};

inline const Pose kRollingFromLocal{Quat(std::cos(0.35), 0.0, 0.0, std::sin(0.35)),
                                    Vec3(3.0, -7.0, 0.0)};

/// A zone around a rectangle in frame world.
inline Zone rectangle(ZoneKind kind, const std::string& name, double west_m, double south_m,
                      double east_m, double north_m, double speed_mps = 0.0) {
  Zone zone;
  zone.kind = kind;
  zone.name = name;
  zone.speed_mps = speed_mps;
  const LocalFrame world(kDatum);
  ZoneRing ring;
  for (const Vec2& p : {Vec2(west_m, south_m), Vec2(east_m, south_m), Vec2(east_m, north_m),
                        Vec2(west_m, north_m)}) {
    const Geodetic g = world.to_geodetic(Vec3(p.x(), p.y(), 0.0));
    ring.push_back({degrees(g.lon_rad), degrees(g.lat_rad)});
  }
  zone.polygons.push_back({ring, {}});
  return zone;
}

/// What happens in a drive.
struct Plan {
  std::vector<Zone> zones;
  Pose2d start;             ///< in frame world
  std::vector<Vec2> goals;  ///< in frame world
  std::int8_t frame = command_t::FRAME_WORLD;
  double speed_mps = 5.0;
  double time_s = 60.0;
  std::function<double(double)> level_m = [](double) { return 1.0; };  ///< over time
  std::function<Vec2(double)> world_error_m = [](double) { return Vec2(0.0, 0.0); };
  double world_from_s = 0.0;  ///< the pose in frame world is valid from then on
  bool gps = true;
};

/// The vehicle, its world model and its superior.
class World final : public Node {
 public:
  World(Bus* bus, const Plan& plan)
      : plan_(plan),
        place_(plan.start),
        drives_(bus, channel::kBgDrive, 8),
        nav_out_(bus, channel::kWmNavState),
        integrity_out_(bus, channel::kWmIntegrity),
        patch_out_(bus, channel::kWmMapPatch),
        fix_out_(bus, channel::kGpsFix),
        command_(bus, channel::kBgCommand, channel::kBgStop, channel::kBgStatus, "zones", {}) {
    GeodeticZones drawn;
    drawn.zones = plan.zones;
    zones_ = drawn.in_world(LocalFrame(kDatum));
    first_m = min_m = clearance();
  }

  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override {
    return {&drives_, &command_.inbox()};
  }
  void run(const Cycle& cycle) override {
    for (; !drives_.empty(); drives_.pop()) drive_ = *drives_.front();
    for (; clock_.due(cycle.now); clock_.advance(cycle.now)) step(cycle.now);
  }

  bool done = false;
  double first_m = 0.0;  ///< clearance of the true outline at the start
  double min_m = 0.0;    ///< the smallest
  double way_m = 0.0;
  double fastest_mps = 0.0;
  double fastest_in_zones_mps = 0.0;
  std::set<std::string> states;
  std::string state;
  std::string reason;
  [[nodiscard]] double clearance() const {
    return zone_clearance(zones_, Body(Shape(), 30.0), place_);
  }

 private:
  void step(Stamp now) {
    const double dt = seconds(kStep);
    const bool valid = drive_.valid_until_utime >= to_utime(now) && drive_.brake == 0;
    const double wanted_mps = valid ? drive_.speed_mps : 0.0;
    const double turn = 0.2 * dt;
    place_.curvature_1pm += std::clamp(drive_.curvature_1pm - place_.curvature_1pm, -turn, turn);
    speed_mps_ += std::clamp(wanted_mps - speed_mps_, -3.0 * dt, 2.0 * dt);
    place_ = along_arc(place_, speed_mps_ * dt);
    way_m += std::abs(speed_mps_) * dt;
    min_m = std::min(min_m, clearance());
    fastest_mps = std::max(fastest_mps, speed_mps_);
    if (std::isfinite(zones_.speed_limit_mps({place_.x_m, place_.y_m}, 0.0))) {
      fastest_in_zones_mps = std::max(fastest_in_zones_mps, speed_mps_);
    }
    command_.step(now);
    if (now >= next_order_) command(now);
    if (command_.status() != nullptr) {
      state = command_.status()->state;
      reason = command_.status()->reason;
      states.insert(state);
      done = done || state == "ARRIVED";
    }
    publish_pose(now);
    if (now >= next_patch_) publish_ground(now);
  }

  void command(Stamp now) {
    rcs::Command order;
    order.kind = command_t::KIND_GOTO;
    order.frame = plan_.frame;
    order.task = 1;
    for (const Vec2& goal : plan_.goals) {
      Vec3 p(goal.x(), goal.y(), 0.0);
      if (plan_.frame != command_t::FRAME_WORLD) p = kLocalFromWorld * p;
      if (plan_.frame == command_t::FRAME_ROLLING) p = kRollingFromLocal * p;
      waypoint_t w{};
      to_message(p, w.p_m);
      w.radius_m = 2.0;
      w.speed_mps = plan_.speed_mps;
      order.waypoints.push_back(w);
    }
    command_.send(order, now);
    next_order_ = now + from_seconds(1.0);
  }

  void publish_pose(Stamp now) {
    const double time_s = seconds(now - kStart);
    const bool world = time_s >= plan_.world_from_s;
    const Pose truth = planar();
    const Vec2 error_m = plan_.world_error_m(time_s);
    Pose T_world_vehicle = truth;
    T_world_vehicle.p += Vec3(error_m.x(), error_m.y(), 0.0);
    nav_.world_resets += error_m != error_m_ ? 1 : 0;
    error_m_ = error_m;
    const Pose T_local_vehicle = kLocalFromWorld * truth;
    if (!world) T_world_vehicle = T_local_vehicle;
    nav_.utime = to_utime(now);
    nav_.mode = nav_state_t::MODE_GPS_INS_LADAR;
    nav_.pose_valid = nav_.rolling_valid = 1;
    nav_.world_valid = world ? 1 : 0;
    nav_.local_utime = to_utime(kStart);
    nav_.datum_lat_deg = degrees(kDatum.lat_rad);
    nav_.datum_lon_deg = degrees(kDatum.lon_rad);
    nav_.datum_height_m = kDatum.height.m;
    to_message(T_local_vehicle, nav_.q_local_vehicle, nav_.p_local_vehicle_m);
    to_message(T_world_vehicle, nav_.q_world_vehicle, nav_.p_world_vehicle_m);
    to_message(kRollingFromLocal * T_local_vehicle, nav_.q_rolling_vehicle,
               nav_.p_rolling_vehicle_m);
    to_message(T_world_vehicle.q * Vec3(speed_mps_, 0.0, 0.0), nav_.v_world_mps);
    nav_.wheel_scale = 1.0;
    for (int k = 0; k < 6; ++k) nav_.cov_world_pose[k][k] = nav_.cov_rolling_pose[k][k] = 1e-4;
    nav_out_.publish(&nav_);
    integrity_t integrity{};
    integrity.utime = nav_.utime;
    integrity.validity = world ? integrity_t::VALID_WORLD : integrity_t::VALID_LOCAL;
    integrity.protection_horizontal_m =
        world ? plan_.level_m(time_s) : std::numeric_limits<double>::infinity();
    integrity.protection_vertical_m = world ? 1.0 : integrity.protection_horizontal_m;
    integrity_out_.publish(&integrity);
    if (!plan_.gps) return;
    const Geodetic g = LocalFrame(kDatum).to_geodetic(truth.p);
    gps_fix_t fix{};
    fix.utime = nav_.utime;
    fix.lat_deg = degrees(g.lat_rad);
    fix.lon_deg = degrees(g.lon_rad);
    fix.height_m = g.height.m;
    fix.sigma_enu_m[0] = fix.sigma_enu_m[1] = fix.sigma_enu_m[2] = 0.5;
    fix.fix_type = gps_fix_t::FIX_SINGLE;
    fix_out_.publish(&fix);
  }

  void publish_ground(Stamp now) {
    next_patch_ = now + kPatch;
    const Vec3 here = (kLocalFromWorld * planar()).p;
    patch_.utime = to_utime(now);
    patch_.local_utime = to_utime(kStart);
    patch_.cell_m = kCell_m;
    patch_.first_i = static_cast<int>(here.x() / kCell_m) - kSide / 2;
    patch_.first_j = static_cast<int>(here.y() / kCell_m) - kSide / 2;
    patch_.width = patch_.height = kSide;
    patch_.n = kSide * kSide;
    const auto cells = static_cast<std::size_t>(patch_.n);
    patch_.height_cm.assign(cells, 0);
    patch_.step_cm.assign(cells, 0);
    patch_.slope_deg.assign(cells, 0);
    patch_.roughness_cm.assign(cells, 0);
    patch_.flags.assign(cells, 0);
    patch_out_.publish(&patch_);
  }

  [[nodiscard]] Pose planar() const {
    return {Quat(Eigen::AngleAxisd(place_.heading_rad, Vec3::UnitZ())),
            Vec3(place_.x_m, place_.y_m, 0.0)};
  }

  const Pose kLocalFromWorld{Quat(Eigen::AngleAxisd(0.8, Vec3::UnitZ())), Vec3(20.0, -30.0, 1.0)};
  NodeInfo info_{"world", from_milliseconds(20.0), Duration(0)};
  PeriodicClock clock_{kStep};
  Plan plan_;
  Zones zones_;
  Pose2d place_;
  double speed_mps_ = 0.0;
  Vec2 error_m_ = Vec2::Zero();
  Stamp next_order_ = Stamp::min();
  Stamp next_patch_ = Stamp::min();
  drive_t drive_{};
  nav_state_t nav_{};
  map_patch_t patch_{};
  Inbox<drive_t> drives_;
  Outbox<nav_state_t> nav_out_;
  Outbox<integrity_t> integrity_out_;
  Outbox<map_patch_t> patch_out_;
  Outbox<gps_fix_t> fix_out_;
  CommandPort command_;
};

/// Runs until the vehicle has arrived, or the time is over.
class Ticks final : public EventSource {
 public:
  Ticks(const World* world, double time_s) : world_(world), end_(kStart + from_seconds(time_s)) {}
  Stamp peek() override { return next_ > end_ || world_->done ? Stamp::max() : next_; }
  void take(SourceEvent* event) override {
    event->channel = "TICK";
    event->data.clear();
    next_ += from_milliseconds(100.0);
  }

 private:
  const World* world_;
  Stamp next_ = kStart;
  Stamp end_;
};

struct Result {
  bool done;
  double first_m, min_m, way_m, fastest_mps, fastest_in_zones_mps;
  std::set<std::string> states;
  std::string state, reason;
};

inline Result drive(const Plan& plan) {
  BgConfig config;
  config.zones.zones = plan.zones;
  LocalBus bus;
  BgNode bg(config, &bus, StopLatch());
  World world(&bus, plan);
  Ticks ticks(&world, plan.time_s);
  LockstepTimeline timeline(&bus, &ticks, Duration(0));
  rcs::run({&bg, &world}, timeline, nullptr);
  return {world.done,   world.first_m,     world.min_m,
          world.way_m,  world.fastest_mps, world.fastest_in_zones_mps,
          world.states, world.state,       world.reason};
}

}  // namespace rcs::bg::zone_world

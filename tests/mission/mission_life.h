#pragma once
// One run of the mission node on a bus of its own, with a simple BG and a simple WM around it.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/path_query_t.hpp"
#include "lcmtypes/rcs/path_uncertainty_t.hpp"
#include "lcmtypes/rcs/routes_t.hpp"
#include "modules/mission/mission_node.h"
#include "rcs/node/budget.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/bus/tap.h"

namespace rcs::mission::test {

class Life {
 public:
  explicit Life(std::optional<RouteGround> ground = std::nullopt,
                const MissionConfig& config = MissionConfig())
      : node_(config, &bus_, std::move(ground)) {
    cycle();
  }

  /// A second, in which the vehicle moves to (x_m, y_m) on a straight line.
  void cycle() {
    constexpr int kPoses = 50;
    for (int k = 1; k <= kPoses; ++k) {
      now_ += from_milliseconds(1000.0 / kPoses);
      const double share = static_cast<double>(k) / kPoses;
      send_nav(from_x_m_ + share * (x_m - from_x_m_), from_y_m_ + share * (y_m - from_y_m_));
    }
    from_x_m_ = x_m;
    from_y_m_ = y_m;
    send_bg_status();
    deliver();
    StageClock stages;
    stages.start_cycle();
    Cycle c;
    c.wakeup = c.now = now_;
    c.deadline = now_ + from_milliseconds(500.0);
    c.stages = &stages;
    node_.run(c);
    deliver();
  }
  void cycles(int n) {
    for (int k = 0; k < n; ++k) cycle();
  }
  /// Cycles until the mission is in a state, at most `most`. @return it is
  bool until(const std::string& state, int most = 30) {
    for (int k = 0; k < most && status.state != state; ++k) cycle();
    return status.state == state;
  }
  /// Another task each time.
  void give(std::int8_t kind, const std::vector<Vec2>& places = {}) {
    command_t m{};
    m.issuer = "operator";
    m.kind = kind;
    m.task = ++task_;
    m.frame = command_t::FRAME_WORLD;
    m.alert_limit_horizontal_m = alert_limit_m;
    for (const Vec2& p : places) {
      waypoint_t w{};
      w.p_m[0] = p.x();
      w.p_m[1] = p.y();
      w.radius_m = 3.0;
      w.speed_mps = 4.0;
      m.waypoint.push_back(w);
    }
    m.n = static_cast<std::int32_t>(places.size());
    given_ = m;
    bg_done = 0;
    renew();
  }
  /// The newest task again.
  void renew() {
    now_ += Duration(1);
    given_.serial = given_.utime = to_utime(now_);
    given_.valid_until_utime = given_.utime + 60'000'000;
    tasks_.publish(&given_);
    cycle();
  }
  /// BG reports an error in each cycle in which it is commanded to drive; empty: it drives.
  void bg_error(const std::string& state, const std::string& reason = "") {
    bg_state_ = state;
    bg_reason_ = reason;
  }
  /// BG keeps the vehicle at rest; empty: it drives.
  void bg_waits(const std::string& reason) { bg_waiting_ = reason; }
  [[nodiscard]] bool drives() const { return bg && bg->kind == command_t::KIND_GOTO; }
  [[nodiscard]] Vec2 bg_place(std::size_t k) const {
    return from_message(bg->waypoint.at(k).p_m).head<2>();
  }
  [[nodiscard]] Vec2 bg_last() const { return bg_place(bg->waypoint.size() - 1); }

  double x_m = 0.0;  // of the vehicle, frames world and rolling
  double y_m = 0.0;
  bool world = true;
  bool gps = true;
  bool stop_latched = false;
  std::int32_t epoch = 3;
  double lon_deg = -76.5;       // of the datum
  double alert_limit_m = 0.0;   // of the tasks
  int bg_done = 0;              // waypoints of the command in force
  std::optional<command_t> bg;  // the newest command
  status_t status{};
  std::vector<routes_t> routes;
  float predicted_sigma_m = 0.1F;  // by WM, along any path
  int predictions = 0;

 private:
  void deliver() {
    while (bus_.next_due() != Stamp::max()) bus_.deliver_next(now_);
  }
  void send_nav(double x, double y) {
    nav_state_t m{};
    m.utime = m.publish_utime = to_utime(now_);
    m.mode = nav_state_t::MODE_GPS_INS_LADAR;
    m.pose_valid = 1;
    m.q_world_vehicle[0] = m.q_local_vehicle[0] = m.q_rolling_vehicle[0] = 1.0;
    m.p_world_vehicle_m[0] = m.p_local_vehicle_m[0] = m.p_rolling_vehicle_m[0] = x;
    m.p_world_vehicle_m[1] = m.p_local_vehicle_m[1] = m.p_rolling_vehicle_m[1] = y;
    for (int k = 0; k < 3; ++k) m.cov_world_pose[k][k] = m.cov_rolling_pose[k][k] = 1e-4;
    m.world_valid = world ? 1 : 0;
    m.rolling_valid = 1;
    m.map_epoch = epoch;
    m.datum_lat_deg = 40.4;
    m.datum_lon_deg = lon_deg;
    m.age_gps_us = gps ? 0 : 60'000'000;
    nav_states_.publish(&m);
    integrity_t integrity{};
    integrity.utime = m.utime;
    integrity.validity = world ? integrity_t::VALID_WORLD : integrity_t::VALID_LOCAL;
    integrity.protection_horizontal_m = integrity.protection_vertical_m = 0.5;
    integrities_.publish(&integrity);
    deliver();
  }
  void send_bg_status() {
    status_t m{};
    m.utime = to_utime(now_);
    m.state = "IDLE";
    m.emergency_stop = stop_latched ? status_t::STOP_PERSISTED : status_t::STOP_NONE;
    if (bg) {
      m.issuer = bg->issuer;
      m.echo_serial = bg->serial;
      const bool error = drives() && !bg_state_.empty();
      m.status = error ? status_t::STATUS_ERROR : status_t::STATUS_EXEC;
      m.state = error ? bg_state_ : drives() ? "DRIVING" : "HALT";
      m.reason = error ? bg_reason_ : drives() ? bg_waiting_ : "";
      m.waypoints_done = drives() ? bg_done : 0;
    }
    bg_statuses_.publish(&m);
  }
  void answer(const path_query_t& query) {
    path_uncertainty_t m{};
    m.utime = to_utime(now_);
    m.issuer = query.issuer;
    m.serial = query.serial;
    m.state = path_uncertainty_t::STATE_ANSWERED;
    m.n = 1;
    m.travelled_m = m.x_m = m.y_m = {0.0F};
    m.sigma_dead_reckoning_m = m.sigma_with_map_m = {predicted_sigma_m};
    ++predictions;
    predictions_.publish(&m);
  }

  Stamp now_{from_seconds(100.0)};
  std::int64_t task_ = 0;
  command_t given_{};
  double from_x_m_ = 0.0;
  double from_y_m_ = 0.0;
  std::string bg_state_;
  std::string bg_reason_;
  std::string bg_waiting_;
  LocalBus bus_;
  Outbox<command_t> tasks_{&bus_, channel::kMissionCommand};
  Outbox<nav_state_t> nav_states_{&bus_, channel::kWmNavState};
  Outbox<integrity_t> integrities_{&bus_, channel::kWmIntegrity};
  Outbox<status_t> bg_statuses_{&bus_, channel::kBgStatus};
  Outbox<path_uncertainty_t> predictions_{&bus_, channel::kWmPathUncertainty};
  Tap<command_t> bg_commands_{&bus_, channel::kBgCommand, [this](const command_t& m, Stamp) {
                                if (!bg || bg->task != m.task || bg->kind != m.kind) bg_done = 0;
                                bg = m;
                              }};
  Tap<path_query_t> queries_{&bus_, channel::kWmPathQuery,
                             [this](const path_query_t& m, Stamp) { answer(m); }};
  Tap<status_t> statuses_{&bus_, channel::kMissionStatus,
                          [this](const status_t& m, Stamp) { status = m; }};
  Tap<routes_t> routes_in_{&bus_, channel::kMissionRoutes,
                           [this](const routes_t& m, Stamp) { routes.push_back(m); }};
  MissionNode node_;
};

}  // namespace rcs::mission::test

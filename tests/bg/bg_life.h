#pragma once
// One run of the BG node on a bus of its own, with a simple vehicle and a world model around it.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "modules/bg/bg_node.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/bus/tap.h"

namespace rcs::bg::test {

inline constexpr std::int8_t kStop = command_t::KIND_EMERGENCY_STOP;
inline constexpr std::int8_t kGoto = command_t::KIND_GOTO;
inline constexpr std::int8_t kRelease = command_t::KIND_RELEASE;

/// BG's bus; it records at each publication whether the file of the latch exists.
class WatchedBus final : public Bus {
 public:
  WatchedBus(std::string file, std::int64_t boot_id) : file_(std::move(file)) {
    set_publisher({0, 0, boot_id});
  }
  void subscribe(std::string_view channel, Receiver* receiver) override {
    bus.subscribe(channel, receiver);
  }
  void publish(std::string_view channel, const std::uint8_t* data, std::size_t size) override {
    if (channel == channel::kBgDrive) file_at_drive = std::filesystem::exists(file_);
    if (channel == channel::kBgStatus) file_at_status = std::filesystem::exists(file_);
    bus.publish(channel, data, size);
  }

  LocalBus bus;
  bool file_at_drive = false;
  bool file_at_status = false;

 private:
  std::string file_;
};

/// One run of the BG process.
class Life {
 public:
  /// @param boot_id  of the computer
  Life(const std::string& file, StopLatch latch, Stamp* now, std::int64_t boot_id = 0,
       const BgConfig& config = BgConfig())
      : boot_id_(boot_id),
        now_(now),
        watched(file, boot_id),
        node_(config, &watched, std::move(latch)) {}

  void cycle() {
    *now_ += from_milliseconds(50.0);
    if (wm_alive) send_nav();
    deliver();
    StageClock stages;
    stages.start_cycle();
    Cycle c;
    c.wakeup = c.now = *now_;
    c.deadline = *now_ + from_milliseconds(40.0);
    c.stages = &stages;
    drive.reset();
    node_.run(c);
    deliver();
    if (moves) move();
  }
  /// A command that is issued now and arrives in the next cycle.
  void send(std::int8_t kind) {
    *now_ += Duration(1);
    send(kind, to_utime(*now_), to_utime(*now_));
  }
  void send(std::int8_t kind, std::int64_t serial, std::int64_t utime) {
    command_t m = command(kind, "operator");
    m.serial = serial;
    m.utime = utime;
    m.valid_until_utime = utime + 2'500'000;
    send(m);
  }
  void send(command_t m) { commands_.publish(&m); }
  /// Issued now; a release names the stops that the newest status lists.
  [[nodiscard]] command_t command(std::int8_t kind, const std::string& issuer) const {
    command_t m{};
    m.issuer = issuer;
    m.boot_id = boot_id_;
    m.kind = kind;
    m.serial = m.utime = to_utime(*now_);
    m.valid_until_utime = m.utime + 2'500'000;
    if (kind == kRelease) {
      for (const stop_t& s : status.stop) m.stop_id.push_back(s.id);
    }
    m.n_stops = static_cast<std::int32_t>(m.stop_id.size());
    m.frame = world ? command_t::FRAME_WORLD : command_t::FRAME_LOCAL;
    m.alert_limit_horizontal_m = alert_limit_m;
    m.n = 1;
    m.waypoint.resize(1);
    m.waypoint[0].p_m[0] = 50.0;
    m.waypoint[0].radius_m = 3.0;
    m.waypoint[0].p_m[0] += x_m;
    m.waypoint[0].speed_mps = 5.0;
    return m;
  }

  [[nodiscard]] bool brakes() const {
    return drive && drive->brake == 1 && drive->speed_mps == 0.0;
  }
  [[nodiscard]] bool has_event(const std::string& text) const {
    for (const std::string& e : events) {
      if (e.find(text) != std::string::npos) return true;
    }
    return false;
  }

 private:
  void move() {
    constexpr double kStep_s = 0.05;
    const double wanted_mps = brakes() || !drive ? 0.0 : drive->speed_mps;
    const double change_mps = (wanted_mps < speed_mps ? 4.0 : 2.0) * kStep_s;
    speed_mps += std::clamp(wanted_mps - speed_mps, -change_mps, change_mps);
    x_m += speed_mps * kStep_s;
  }
  void deliver() {
    while (watched.bus.next_due() != Stamp::max()) watched.bus.deliver_next(*now_);
  }
  void send_nav() {
    nav_state_t m{};
    m.utime = m.publish_utime = to_utime(*now_);
    m.mode = nav_state_t::MODE_GPS_INS_LADAR;
    m.pose_valid = 1;
    m.q_world_vehicle[0] = m.q_local_vehicle[0] = 1.0;
    m.v_world_mps[0] = speed_mps;
    m.p_world_vehicle_m[0] = m.p_local_vehicle_m[0] = x_m;
    m.world_valid = world ? 1 : 0;
    m.rolling_valid = has_rolling_map ? 1 : 0;
    m.q_rolling_vehicle[0] = 1.0;
    for (int k = 0; k < 3; ++k) m.cov_rolling_pose[k][k] = local_sigma_m * local_sigma_m;
    nav_states_.publish(&m);
    integrity_t integrity{};
    integrity.utime = m.utime;
    integrity.validity = world ? integrity_t::VALID_WORLD : integrity_t::VALID_LOCAL;
    integrity.protection_horizontal_m = integrity.protection_vertical_m = 8.0;
    integrities_.publish(&integrity);
    if (world || sees_ground) send_flat_ground(m.utime);
  }
  void send_flat_ground(std::int64_t utime) {
    constexpr int kSide = 50;
    constexpr std::size_t kCells = std::size_t{kSide} * kSide;
    map_patch_t m{};
    m.utime = utime;
    m.cell_m = 0.4;
    m.first_i = static_cast<std::int32_t>(std::floor(x_m / m.cell_m)) - kSide / 2;
    m.first_j = -kSide / 2;
    m.width = m.height = kSide;
    m.n = kCells;
    m.height_cm.assign(kCells, 0);
    m.step_cm.assign(kCells, 0);
    m.slope_deg.assign(kCells, 0);
    m.roughness_cm.assign(kCells, 0);
    m.flags.assign(kCells, 0);
    patches_.publish(&m);
  }

  std::int64_t boot_id_;
  Stamp* now_;

 public:
  WatchedBus watched;
  double speed_mps = 0.0;
  double x_m = 0.0;
  bool moves = false;  // speed and position follow the drive commands
  bool wm_alive = true;
  bool world = false;          // commands and poses in frame world, protection level 8 m
  double alert_limit_m = 0.0;  // of the commands
  bool sees_ground = false;    // also in frame local
  bool has_rolling_map = true;
  double local_sigma_m = 0.02;   // relative to the rolling map
  std::optional<drive_t> drive;  // of the last cycle
  status_t status{};
  std::vector<std::string> events;

 private:
  Outbox<command_t> commands_{&watched.bus, channel::kBgCommand};
  Outbox<nav_state_t> nav_states_{&watched.bus, channel::kWmNavState};
  Outbox<integrity_t> integrities_{&watched.bus, channel::kWmIntegrity};
  Outbox<map_patch_t> patches_{&watched.bus, channel::kWmMapPatch};
  Tap<drive_t> drives_{&watched.bus, channel::kBgDrive,
                       [this](const drive_t& m, Stamp) { drive = m; }};
  Tap<status_t> statuses_{&watched.bus, channel::kBgStatus,
                          [this](const status_t& m, Stamp) { status = m; }};
  Tap<event_t> events_{&watched.bus, channel::kBgEvent, [this](const event_t& m, Stamp) {
                         events.push_back(m.code + ": " + m.text);
                       }};
  BgNode node_;
};

}  // namespace rcs::bg::test

#pragma once
// The bg process on a private bus (with_bus.sh). The test acts as WM, the operator and a superior
// that keeps commanding.

#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "rcs/base/check.h"
#include "rcs/node/bus/lcm_bus.h"
#include "rcs/node/bus/tap.h"
#include "rcs/node/command_port.h"
#include "rcs/node/node.h"
#include "rcs/node/timeline/live_timeline.h"
#include "tests/gateway/program.h"
#include "tests/support/fresh_folder.h"

namespace rcs::bg::test {

inline constexpr Duration kPatience = from_seconds(60.0);  // a loaded computer is slow
inline constexpr Duration kCycle = from_milliseconds(50.0);
inline constexpr Duration kCommandAgain = from_milliseconds(250.0);

inline constexpr char kConfig[] = "[process]\nstate_directory = \"state\"\n";

/// Of one run with BG: of the same configuration.
inline std::unique_ptr<LcmBus> open_bus(const std::string& config = kConfig) {
  Result<std::unique_ptr<LcmBus>> bus = LcmBus::create(kDefaultLcmUrl);
  RCS_CHECK(bus.ok());
  Publisher publisher = (*bus)->publisher();
  publisher.run_id = live_run_id(id_of(config));
  (*bus)->set_publisher(publisher);
  return std::move(bus).value();
}

class LiveBg : public testing::Test {
 protected:
  explicit LiveBg(const std::string& config = kConfig) : bus_(open_bus(config)) {
    const std::filesystem::path folder = rcs::test::fresh_folder();
    config_ = (folder / "vehicle.toml").string();
    std::ofstream(config_) << config;
    start_bg();
  }

  void start_bg() {
    bg_ = std::make_unique<rcs::test::Program>(
        std::vector<std::string>{rcs::test::program_path("bg"), config_},
        std::vector<std::string>{});
  }
  void kill_bg() {
    bg_->signal(SIGKILL);
    ASSERT_TRUE(run_until([&] { return bg_->status() >= 0; }));
  }

  /// WM at rest, and a superior that commands.
  template <class Enough>
  bool run_until(const Enough& enough) {
    const Stamp end = timeline_.now() + kPatience;
    while (!enough()) {
      if (timeline_.now() >= end) return false;
      while (timeline_.advance(clock_.next()) == Timeline::Step::kDelivered) {
      }
      const Stamp now = timeline_.now();
      if (!clock_.due(now)) return false;  // stopped from outside
      clock_.advance(now);
      nav_state_t m{};
      m.utime = m.publish_utime = to_utime(now);
      m.mode = nav_state_t::MODE_GPS_INS_LADAR;
      m.pose_valid = 1;
      m.q_world_vehicle[0] = m.q_local_vehicle[0] = m.q_rolling_vehicle[0] = 1.0;
      m.rolling_valid = 1;
      nav_states_.publish(&m);
      integrity_t integrity{};
      integrity.utime = m.utime;
      integrity.validity = integrity_t::VALID_LOCAL;
      integrities_.publish(&integrity);
      if (now >= next_goto_) {
        superior_.send(to_waypoint(), now);
        next_goto_ = now + kCommandAgain;
      }
      superior_.step(now);
      operator_.step(now);
    }
    return true;
  }
  void ask(std::int8_t kind) {
    Command order;
    order.kind = kind;
    if (kind == command_t::KIND_RELEASE) order.released = operator_.listed_stops("");
    operator_.send(order, timeline_.now());
  }
  static Command to_waypoint() {
    Command order;
    order.kind = command_t::KIND_GOTO;
    order.frame = command_t::FRAME_LOCAL;
    order.waypoints.resize(1);
    order.waypoints[0].p_m[0] = 50.0;
    order.waypoints[0].radius_m = 3.0;
    order.waypoints[0].speed_mps = 5.0;
    return order;
  }

  /// Since the newest reset.
  struct Seen {
    int drives = 0;
    int unbraked = 0;
    int refused = 0;               ///< GOTO commands, because a stop is latched
    std::optional<Stamp> stopped;  ///< arrival of the first full brake of an emergency stop
  };

  std::string config_;
  StopSignals stop_;
  std::unique_ptr<LcmBus> bus_;
  LiveTimeline timeline_{bus_.get(), &stop_};
  PeriodicClock clock_{kCycle};
  Outbox<nav_state_t> nav_states_{bus_.get(), channel::kWmNavState};
  Outbox<integrity_t> integrities_{bus_.get(), channel::kWmIntegrity};
  Outbox<command_t> raw_{bus_.get(), channel::kBgCommand};
  CommandPort superior_{bus_.get(),         channel::kBgCommand, channel::kBgStop,
                        channel::kBgStatus, "superior",          {}};
  CommandPort operator_{bus_.get(),         channel::kBgCommand, channel::kBgStop,
                        channel::kBgStatus, "operator",          {}};
  Stamp next_goto_ = Stamp::min();
  Seen seen_;
  Tap<drive_t> drives_{bus_.get(), channel::kBgDrive, [this](const drive_t& m, Stamp at) {
                         ++seen_.drives;
                         const bool braked = m.brake == 1 && m.speed_mps == 0.0;
                         if (!braked) ++seen_.unbraked;
                         if (braked && m.emergency_stop == 1 && !seen_.stopped) {
                           seen_.stopped = at;
                         }
                       }};
  Tap<status_t> statuses_{bus_.get(), channel::kBgStatus, [this](const status_t& m, Stamp) {
                            if (m.state == "EMERGENCY_STOP" && m.issuer == "superior" &&
                                m.status == status_t::STATUS_ERROR) {
                              ++seen_.refused;
                            }
                          }};
  std::unique_ptr<rcs::test::Program> bg_;
};

}  // namespace rcs::bg::test

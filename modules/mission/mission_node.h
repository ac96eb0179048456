#pragma once
// The message shell of the vehicle level: receives tasks, commands BG along routes.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/local_levels.h"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "modules/mission/bg_route.h"
#include "modules/mission/mission_config.h"
#include "modules/mission/route_planner_node.h"
#include "modules/mission/way_back.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/command_port.h"
#include "rcs/node/report.h"

namespace rcs::mission {

class MissionNode final : public Node {
 public:
  /// @param ground  absent: no a priori map, routes are straight
  MissionNode(const MissionConfig& config, Bus* bus, std::optional<RouteGround> ground);

  [[nodiscard]] const NodeInfo& info() const override { return config_.info; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  void run(const Cycle& cycle) override;
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override;
  [[nodiscard]] std::int64_t missed_cycles() const override { return clock_.missed(); }

 private:
  void take_task();
  void take_nav(Stamp now);
  /// Rejects the task if zones forbid it.
  void check_zones();
  void note_way();
  [[nodiscard]] Facts facts(Stamp now);
  void act(const Decision& decision, Stamp now);
  void begin_route();
  /// While the heading of the vehicle is unknown, BG drives straight ahead towards any place.
  void begin_towards_first_place(Stamp now);
  [[nodiscard]] RoutePlanner::Query route_query() const;
  void plan(Stamp now);
  void begin_return(Stamp now);
  void send(std::int8_t kind, Stamp now);
  void exclude_blocked(Stamp now);
  void publish_status(const Decision& decision, Stamp now);
  [[nodiscard]] double alert_limit_m() const;

  MissionConfig config_;
  PeriodicClock clock_;
  Subordinate subordinate_;
  CommandPort port_;
  Inbox<nav_state_t> nav_states_;
  Inbox<integrity_t> integrities_;
  RoutePlanner planner_;
  Report report_;

  // the newest belief
  Stamp nav_arrival_ = Stamp::min();
  bool pose_valid_ = false;
  bool world_valid_ = false;
  Pose T_world_vehicle_;
  Vec3 datum_ = Vec3::Zero();  // latitude, longitude [deg], height [m]
  Breadcrumb here_;
  double own_map_m_ = 0.0;
  double sigma_world_m_ = 0.0;  // worst horizontal direction
  double level_m_ = 0.0;
  Duration gps_age_ = Duration::max();
  Stamp above_since_ = Stamp::max();

  // the task
  std::string_view cannot_;
  bool zones_unchecked_ = false;
  std::int64_t task_of_ = 0;  // command_t::task
  std::string issuer_;
  std::size_t places_done_ = 0;
  std::vector<std::size_t> place_ends_;  // of bg_route_: the places that are those of the task
  std::int64_t task_ = 0;                // of the commands to BG
  std::int8_t sent_ = -1;                // kind of the newest one
  RouteState route_state_ = RouteState::kNone;
  bool chosen_with_gps_ = true;
  BgRoute bg_route_;
  bool rolling_ = false;  // frame of bg_route_
  std::int32_t epoch_ = -1;
  bool on_way_back_ = false;   // bg_route_
  bool to_the_start_ = false;  // its end is the start of the way
  bool returning_ = false;     // instead of the task
  int blocked_ = 0;
  WayBack way_;
  std::string_view reported_state_;
};

[[nodiscard]] Result<std::unique_ptr<Node>> make_mission_node(const ParamFile& file, Bus* bus);

}  // namespace rcs::mission

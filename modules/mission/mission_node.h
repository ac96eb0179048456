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
#include "lcmtypes/rcs/path_query_t.hpp"
#include "lcmtypes/rcs/path_uncertainty_t.hpp"
#include "lcmtypes/rcs/routes_t.hpp"
#include "modules/mission/bg_route.h"
#include "modules/mission/mission_config.h"
#include "modules/mission/route_choice.h"
#include "modules/mission/way_back.h"
#include "rcs/base/geodesy.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/command_port.h"
#include "rcs/node/report.h"

namespace rcs::mission {

/// The a priori map of routes, and where it lies.
struct RouteGround {
  RouteMap map;
  Geodetic datum;
};

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
  void take_predictions();
  void note_way();
  [[nodiscard]] Facts facts(Stamp now);
  void act(const Decision& decision, Stamp now);
  void begin_route();
  /// While the heading of the vehicle is unknown, BG drives straight ahead towards any place.
  void begin_towards_first_place(Stamp now);
  /// Searches one candidate, or asks WM about one; chooses when all are known.
  void plan(Stamp now);
  void ask(const Candidate& candidate, Stamp now);
  void choose(Stamp now);
  void begin_return(Stamp now);
  void send(std::int8_t kind, Stamp now);
  void exclude_blocked(Stamp now);
  void publish_routes(Stamp now);
  void publish_status(const Decision& decision, Stamp now);
  [[nodiscard]] double alert_limit_m() const;
  [[nodiscard]] Vec2 to_map(const Vec3& p_world) const;
  [[nodiscard]] Vec2 to_world(const Vec2& p_map) const;
  /// The map of the search: the a priori map, or open ground around the task.
  [[nodiscard]] RouteMap& map() { return ground_ ? ground_->map : open_ground_; }

  MissionConfig config_;
  PeriodicClock clock_;
  Subordinate subordinate_;
  CommandPort port_;
  Inbox<nav_state_t> nav_states_;
  Inbox<integrity_t> integrities_;
  Inbox<path_uncertainty_t> predictions_;
  Outbox<path_query_t> queries_;
  Outbox<routes_t> routes_out_;
  Report report_;
  std::optional<RouteGround> ground_;
  RouteMap open_ground_;

  // the newest belief
  Stamp nav_arrival_ = Stamp::min();
  bool pose_valid_ = false;
  bool world_valid_ = false;
  Pose T_world_vehicle_;
  Vec3 datum_ = Vec3::Zero();  // latitude, longitude [deg], height [m]
  Pose T_map_world_;
  Breadcrumb here_;
  double own_map_m_ = 0.0;
  double level_m_ = 0.0;
  Duration gps_age_ = Duration::max();
  Stamp above_since_ = Stamp::max();

  // the task
  std::string_view cannot_;
  std::int64_t task_of_ = 0;  // command_t::task
  std::string issuer_;
  std::size_t places_done_ = 0;
  std::vector<std::size_t> place_ends_;  // of bg_route_: the places that are those of the task
  std::int64_t task_ = 0;                // of the commands to BG
  std::int8_t sent_ = -1;                // kind of the newest one
  RouteChoice choice_;
  bool choosing_ = false;
  RouteState route_state_ = RouteState::kNone;
  bool chosen_with_gps_ = true;
  Stamp asked_at_ = Stamp::min();
  Stamp asked_since_ = Stamp::min();
  std::int64_t asked_ = 0;  // serial of the query; 0: none
  BgRoute bg_route_;
  bool rolling_ = false;  // frame of bg_route_
  std::int32_t epoch_ = -1;
  bool on_way_back_ = false;   // bg_route_
  bool to_the_start_ = false;  // its end is the start of the way
  bool returning_ = false;     // instead of the task
  int blocked_ = 0;
  WayBack way_;
  std::string_view reported_state_;
  routes_t routes_{};
};

[[nodiscard]] Result<std::unique_ptr<Node>> make_mission_node(const ParamFile& file, Bus* bus);

}  // namespace rcs::mission

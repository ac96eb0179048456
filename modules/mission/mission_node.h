#pragma once
// The message shell of the vehicle level: receives tasks, commands BG along routes.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "modules/mission/belief_node.h"
#include "modules/mission/bg_route.h"
#include "modules/mission/mission_config.h"
#include "modules/mission/route_planner_node.h"
#include "modules/mission/way_back.h"
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
  /// Where the places that BG is sent lead.
  enum class Leads { kTask, kAhead, kBack };

  [[nodiscard]] bool stopped() const;
  void take_task();
  void take_datum();
  /// Rejects the task if zones forbid it.
  void check_zones();
  /// Progress and error of BG along the route that it was sent.
  void note_bg(Stamp now);
  void note_bg_error(const status_t& bg, Stamp now);
  [[nodiscard]] Facts facts(Stamp now);
  void act(const Decision& decision, Stamp now);
  void begin_route();
  /// While the heading of the vehicle is unknown, BG drives straight ahead towards any place.
  void begin_towards_first_place(Stamp now);
  [[nodiscard]] RoutePlanner::Query route_query() const;
  void plan(Stamp now);
  [[nodiscard]] bool on_way_back() const;
  void begin_return(Stamp now);
  void begin_bg_route(Leads leads, std::vector<RoutePlace> places, Stamp now);
  /// BG's route begins again in the next cycle.
  void drop_bg_route();
  void send(std::int8_t kind, Stamp now);
  void exclude_blocked(Stamp now);
  void publish_status(const Decision& decision, Stamp now);
  [[nodiscard]] double alert_limit_m() const;
  [[nodiscard]] bool gps() const { return belief_.newest().gps_age <= config_.gps_loss; }

  MissionConfig config_;
  PeriodicClock clock_;
  Subordinate subordinate_;
  CommandPort port_;
  BeliefInput belief_;
  RoutePlanner planner_;
  Report report_;
  Stamp above_since_ = Stamp::max();

  command_t task_{};  // as given first; its waypoints are in frame world of now
  std::string_view cannot_;
  bool zones_unchecked_ = false;
  std::size_t places_done_ = 0;
  RouteState route_state_ = RouteState::kNone;
  bool chosen_with_gps_ = true;
  int blocked_ = 0;
  bool rejected_ = false;   // BG has rejected a route of it
  bool returning_ = false;  // instead of the task
  WayBack way_;

  BgRoute bg_route_;
  Leads leads_ = Leads::kTask;           // of bg_route_
  std::vector<std::size_t> place_ends_;  // of bg_route_: the places that are those of the task
  bool rolling_ = false;                 // frame of bg_route_
  std::int32_t epoch_ = -1;
  bool to_the_start_ = false;  // the end of bg_route_ is the start of the way
  std::int64_t bg_task_ = 0;   // of the commands to BG
  std::int8_t sent_ = -1;      // kind of the newest one
  bool executed_ = false;      // BG has not rejected bg_route_
  BgError bg_error_ = BgError::kNone;
  std::string bg_reason_;
  std::string bg_waits_;  // why it does
  Stamp bg_error_since_{};
  Duration bg_error_for_{};
  std::string_view reported_state_;
};

[[nodiscard]] Result<std::unique_ptr<Node>> make_mission_node(const ParamFile& file, Bus* bus);

}  // namespace rcs::mission

#pragma once
// The message shell of BG: receives commands, the belief and the terrain, publishes drive commands.

#include <cstdint>
#include <memory>

#include "lcmtypes/rcs/plan_t.hpp"
#include "modules/bg/bg_config.h"
#include "modules/bg/bg_inputs_node.h"
#include "modules/bg/bg_messages_node.h"
#include "modules/bg/drive_node.h"
#include "modules/bg/local_route_node.h"
#include "modules/bg/planner.h"
#include "modules/bg/required_clearance.h"
#include "modules/bg/scan_watch.h"
#include "modules/bg/stop_node.h"
#include "modules/bg/trail.h"
#include "modules/bg/unverified_ground.h"
#include "modules/bg/way_back.h"
#include "modules/bg/zone_node.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/command_port.h"
#include "rcs/node/report.h"

namespace rcs::bg {

class BgNode final : public Node {
 public:
  /// @param supervised  `rcs up` has started this process: its silence stops the vehicle
  BgNode(const BgConfig& config, Bus* bus, StopLatch latch, bool supervised = false);

  [[nodiscard]] const NodeInfo& info() const override { return config_.info; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  void run(const Cycle& cycle) override;
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override;
  [[nodiscard]] Duration nominal_compute() const override;
  [[nodiscard]] std::int64_t missed_cycles() const override { return clock_.missed(); }

 private:
  void take_command();
  void take_nav(const Cycle& cycle);
  void take_map(const Cycle& cycle);
  /// Rejects the command if one of its waypoints is forbidden.
  void check_zones();
  [[nodiscard]] double speed_share() const;
  void leave_trail();
  [[nodiscard]] bool map_is_of_now() const;
  [[nodiscard]] Pose2d place() const;
  /// Of the vehicle, on the last map.
  [[nodiscard]] double clearance() const;
  /// Into candidate_, up to the first obstacle.
  WayBackWatch::Along plan_way_back(double speed_mps, Stamp now);
  [[nodiscard]] Facts facts(Stamp now) const;
  void plan(const Cycle& cycle, const Facts& facts);
  [[nodiscard]] Start start(double speed_mps) const;
  /// Leads back where no scan could be registered for a while, and out of an obstacle.
  void back_out(Stamp now, const Facts& facts);
  void lead_back(const Facts& facts);
  void cut_at_obstacles(std::size_t at, Path* path) const;
  [[nodiscard]] double long_enough_m(double speed_mps) const;
  void drive(const Cycle& cycle, const Decision& decision);
  /// Replaces the path of a vehicle that an obstacle keeps at rest.
  void leave_way_if_held(Stamp now, bool held);
  void publish_plan(Stamp now);
  void publish_status(const Decision& decision, Stamp now);

  BgConfig config_;
  PeriodicClock clock_;
  PeriodicClock plan_clock_;
  Subordinate subordinate_;
  BgInputs inputs_;
  DriveCommand drive_;
  Outbox<plan_t> plan_out_;
  Report report_;

  Nav nav_;
  Stamp nav_moved_ = Stamp::min();  // arrival of the newest message with a new sensor time
  vj::Terrain terrain_;             // frame local
  Stamp terrain_stamp_ = Stamp::min();
  std::int64_t terrain_local_utime_ = 0;
  ScanWatch scan_watch_;         // of terrain_
  Trail trail_;                  // frame local
  HiddenGround hidden_;          // frame local
  UnverifiedGround unverified_;  // frame local
  ZoneWatch zones_;
  bool zones_unchecked_ = false;  // of the command in force
  std::int64_t trail_local_utime_ = 0;
  ObstacleDistance obstacles_;
  RequiredClearance required_;
  Planner planner_;  // frame local

  LocalRoute route_;
  std::vector<Vec2> way_back_;  // frame local
  WayBackWatch way_back_watch_;
  std::string_view cannot_;
  EmergencyStop emergency_stop_;

  Path path_;  // frame local of path_local_utime_
  Path candidate_;
  std::size_t at_ = 0;
  std::int64_t path_local_utime_ = 0;
  SearchResult found_;
  Stamp unregistered_since_ = Stamp::max();  // at rest
  bool leads_back_ = false;                  // path_
  bool leaves_obstacle_ = false;             // path_, which leads back
  Stamp path_since_ = Stamp::min();          // when a path last existed, or the route began
  Steering steering_;
  Stamp held_since_ = Stamp::max();  // at rest although the path continues
  Pose2d held_at_;                   // where a path was dropped for that reason
  std::string_view reported_state_;

  plan_t plan_{};
};

/// For replay and simulation: emergency stops are latched in memory only.
[[nodiscard]] Result<std::unique_ptr<Node>> make_bg_node(const ParamFile& file, Bus* bus);
/// For a vehicle: emergency stops are latched in a file, see open_stop_latch().
[[nodiscard]] Result<std::unique_ptr<Node>> make_live_bg_node(const ParamFile& file, Bus* bus);

}  // namespace rcs::bg

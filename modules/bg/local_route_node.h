#pragma once
// The route of a command where the vehicle is now: in frame local, whatever its own frame is.

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "modules/bg/bg_messages_node.h"
#include "modules/bg/path.h"
#include "modules/bg/remembered_ground.h"
#include "rcs/base/linear.h"

namespace rcs::bg {

class LocalRoute {
 public:
  /// @param north_m  distance that is driven ahead while the heading is unknown
  explicit LocalRoute(double north_m) : north_m_(north_m) {}

  /// See Route::take() and clear().
  std::string_view take(const command_t& goto_command) { return route_.take(goto_command); }
  void clear() { route_.clear(); }
  /// Another task has begun, or none is left.
  void begin();
  /// For each belief. Without a configured datum a restarted WM begins another frame world, in
  /// which the same coordinates mean other places.
  void note_datum(const Nav& nav);

  [[nodiscard]] const Route& route() const { return route_; }
  [[nodiscard]] bool in_other_world() const { return other_world_; }
  /// The rolling map of the route is no longer that of SP.
  [[nodiscard]] bool in_other_map(const Nav& nav) const;
  /// WM knows the frame of the route.
  [[nodiscard]] bool knows_north(const Nav& nav) const {
    return !route_.in_world() || nav.world_valid;
  }

  /// The next waypoint; on a way back a place ahead. A waypoint in frame world moves in frame local
  /// with the corrections of WM.
  [[nodiscard]] Goal goal(const Nav& nav, const Pose2d& vehicle);
  /// The waypoint after it, if it exists and the vehicle may drive through.
  [[nodiscard]] std::optional<Goal> onward_goal(const Nav& nav) const;
  /// Marks the waypoints as done that the vehicle has reached.
  void pass(const Nav& nav, const Pose2d& vehicle);

  /// A way back, around the vehicle and up to `ahead_m` ahead; empty: the command is not in frame
  /// rolling.
  void way_back(const Nav& nav, double ahead_m, std::vector<Vec2>* places) const;
  /// The place is in the last waypoint.
  [[nodiscard]] bool ends_at(const Pose2d& place, const Nav& nav) const;

 private:
  [[nodiscard]] Goal goal_of(const waypoint_t& w, const Nav& nav) const;
  [[nodiscard]] std::size_t next() const { return static_cast<std::size_t>(route_.done()); }

  double north_m_;
  Route route_;
  std::optional<Vec3> datum_;  // of frame world of the route
  bool other_world_ = false;   // WM has begun another frame world meanwhile
  std::optional<Goal> ahead_;  // where to drive while the heading is unknown
};

}  // namespace rcs::bg

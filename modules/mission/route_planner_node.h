#pragma once
// The search of a route in the shell of the vehicle level: asks WM for the uncertainty along the
// candidates, and publishes them with their values.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/path_query_t.hpp"
#include "lcmtypes/rcs/path_uncertainty_t.hpp"
#include "lcmtypes/rcs/routes_t.hpp"
#include "modules/mission/bg_route.h"
#include "modules/mission/mission_config.h"
#include "modules/mission/route_choice.h"
#include "rcs/base/geodesy.h"
#include "rcs/base/pose.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"

namespace rcs::mission {

/// The a priori map of routes, and where it lies.
struct RouteGround {
  RouteMap map;
  Geodetic datum;
};

/// A route of a task, in frame world.
struct TaskRoute {
  std::vector<RoutePlace> places;
  std::vector<std::size_t> ends;  ///< of the waypoints of the task: one past their place
};

/// The a priori map of the configuration; absent: none.
[[nodiscard]] Result<std::optional<RouteGround>> load_ground(const MissionConfig& config);

class RoutePlanner {
 public:
  /// What is searched.
  struct Query {
    const command_t& task;
    std::size_t done;     ///< waypoints
    Vec3 from;            ///< frame world
    double level_m;       ///< horizontal protection level there; infinite: none
    double undetected_m;  ///< part of it beyond that of the standard deviation; finite
    double alert_limit_m;
  };
  enum class State { kIdle, kSearching, kChosen, kImpossible };

  /// @param ground  absent: no a priori map, the ground is open
  RoutePlanner(const MissionConfig& config, Bus* bus, std::optional<RouteGround> ground);

  [[nodiscard]] const InboxBase& inbox() const { return predictions_; }

  /// Of frame world, from now on: latitude, longitude [deg], height [m]. Call it before all others.
  void set_datum(const Vec3& datum_deg);

  /// Why zones forbid a task; empty: they do not. Valid until the next call.
  [[nodiscard]] std::string_view objection(const command_t& task);

  /// Another task: the ground that was blocked for the last one may be free.
  void begin_task();
  void begin(const Query& query);
  void stop();
  [[nodiscard]] bool searching() const { return state_ == State::kSearching; }

  /// Takes the answers of WM.
  void take_predictions();
  /// Searches one candidate, or asks WM about one; chooses when all are known.
  /// @param gps  received
  /// @param route  set with kChosen
  State step(const Query& query, bool gps, Stamp now, TaskRoute* route);

  /// Asks WM at intervals about the rest of the chosen route while it is driven.
  /// @param route  that BG is sent along, frame world
  /// @return false: the route kept the alert limit when it was chosen, but its rest does not by the
  /// newest prediction
  [[nodiscard]] bool keeps_limit(const Query& query, const BgRoute& route, Stamp now);

  /// BG found no path there: routes of this task avoid it.
  void block(const Vec3& p_world, double radius_m);

  /// Of the last choice, for the event.
  [[nodiscard]] const Candidate& chosen() const { return *chosen_; }
  [[nodiscard]] std::size_t candidates() const { return choice_.candidates().size(); }

 private:
  [[nodiscard]] Vec2 to_map(const Vec3& p_world) const;
  [[nodiscard]] Vec2 to_world(const Vec2& p_map) const;
  /// The map of the search: the a priori map, or open ground around the task.
  [[nodiscard]] RouteMap& map() { return ground_ ? ground_->map : open_ground_; }
  void begin_search();
  /// @param places  of a path, frame world
  void ask(const std::vector<Vec2>& places, Stamp now);
  void ask(const Candidate& candidate, Stamp now);
  /// No more about the rest of the route.
  void stop_asking();
  void publish(const Query& query, bool gps, Stamp now);
  /// The rest of a route for a vehicle that has driven on since the search began.
  [[nodiscard]] TaskRoute route_of(const Candidate& candidate, const Query& query) const;

  MissionConfig config_;
  Inbox<path_uncertainty_t> predictions_;
  Outbox<path_query_t> queries_;
  Outbox<routes_t> routes_out_;
  std::optional<RouteGround> ground_;
  RouteMap open_ground_;
  Pose T_map_world_;
  Zones zones_;  // frame of the map
  std::string objection_;

  State state_ = State::kIdle;
  RouteChoice choice_;
  const Candidate* chosen_ = nullptr;
  std::vector<Vec2> places_;
  std::size_t done_ = 0;  // waypoints, when the search began
  bool prescribed_ = false;
  double clearance_m_ = 0.0;      // from forbidden ground
  double min_clearance_m_ = 0.0;  // if there is no route with the usual one
  Stamp asked_at_ = Stamp::min();
  Stamp asked_since_ = Stamp::min();
  std::int64_t asked_ = 0;   // serial of the query; 0: none
  bool about_rest_ = false;  // the query is about the rest of a route
  Stamp predicted_at_{};     // of the route, or of its rest
  std::optional<double> rest_sigma_m_;
  routes_t routes_{};
};

}  // namespace rcs::mission

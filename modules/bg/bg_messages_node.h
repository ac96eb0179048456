#pragma once
// Validates and converts the messages that BG receives, and converts its plan; the code behind it
// relies on valid data.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/local_levels.h"
#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "modules/bg/decide.h"
#include "modules/bg/path.h"
#include "modules/vj/traversal_cost.h"
#include "rcs/base/geodesy.h"
#include "rcs/base/pose.h"
#include "rcs/base/stamp.h"
#include "rcs/node/waypoint_check.h"

namespace rcs::bg {

[[nodiscard]] CommandKind kind_of(const command_t& m);

/// The waypoints of the newest GOTO and the progress along them.
class Route {
 public:
  Route() { waypoints_.reserve(kMaxWaypoints); }

  /// A command that repeats the current task changes nothing. One of the same task that contains
  /// the next waypoint replaces the waypoints, and the route goes on there without a stop: a long
  /// route comes in parts. A new task begins after the waypoints that its superior reports as done.
  /// @return why its content cannot be executed, and then the route is empty; empty: it can
  std::string_view take(const command_t& goto_command);
  void clear();
  /// Marks the next waypoint as done.
  void pass() { ++next_; }
  void pass_to(std::size_t next) { next_ = next; }
  /// The first waypoint after the next one that is `distance_m` farther along the route, or the
  /// last.
  [[nodiscard]] std::size_t ahead(std::size_t from, double distance_m) const;

  [[nodiscard]] bool arrived() const { return next_ >= waypoints_.size(); }
  [[nodiscard]] int done() const { return static_cast<int>(next_); }
  [[nodiscard]] int size() const { return static_cast<int>(waypoints_.size()); }
  [[nodiscard]] const waypoint_t& next() const { return waypoints_[next_]; }  ///< !arrived()
  /// Null: next() is the last one.
  [[nodiscard]] const waypoint_t* after_next() const {
    return next_ + 1 < waypoints_.size() ? &waypoints_[next_ + 1] : nullptr;
  }
  [[nodiscard]] bool in_world() const { return frame_ == command_t::FRAME_WORLD; }
  /// The map epoch of a route in frame rolling.
  [[nodiscard]] std::optional<std::int32_t> map_epoch() const {
    return frame_ == command_t::FRAME_ROLLING ? std::optional(map_epoch_) : std::nullopt;
  }
  [[nodiscard]] const waypoint_t& waypoint(std::size_t k) const {  ///< k < size()
    return waypoints_[k];
  }
  /// Changes with each new task and with clear().
  [[nodiscard]] int number() const { return number_; }

 private:
  [[nodiscard]] bool is_task_of(const command_t& m) const;

  std::vector<waypoint_t> waypoints_;
  std::size_t next_ = 0;
  std::int8_t frame_ = command_t::FRAME_WORLD;
  std::int32_t map_epoch_ = 0;
  std::string issuer_;
  std::int64_t task_ = 0;
  int number_ = 0;
};

/// The belief of WM, as BG needs it.
struct Nav {
  Stamp stamp;
  Stamp arrival = Stamp::min();  ///< min: none yet
  std::int64_t local_utime = 0;
  Pose T_local_vehicle;
  Pose T_world_vehicle;
  bool world_valid = false;
  std::int32_t world_resets = 0;  ///< steps of frame world
  Vec3 datum = Vec3::Zero();      ///< of the world: latitude, longitude [deg], height [m]
  bool pose_valid = false;
  bool aligned = false;
  double speed_mps = 0.0;
  double sigma_world_m = 0.0;
  std::int32_t map_epoch = -1;  ///< of frame rolling; -1: none
  Pose T_rolling_vehicle;
  LocalLevels local;   ///< to which a task in frame local or rolling refers
  Duration ins_age{};  ///< 0: no INS yet
  Duration ladar_age = Duration::max();
  Duration gps_age = Duration::max();
};

/// The integrity of the pose, as published by WM.
struct Integrity {
  Stamp arrival = Stamp::min();  ///< min(): none yet
  bool pose_valid = false;
  double horizontal_m = 0.0;  ///< protection levels in frame world; infinite: no bound
  double vertical_m = 0.0;
};

/// Position of the antenna of GPS.
struct GpsPosition {
  Stamp arrival;
  Geodetic antenna;
  double sigma_m = 0.0;  ///< the larger horizontal one
};

/// False, and `nav` untouched, if the pose or the motion is invalid.
[[nodiscard]] bool read_nav(const nav_state_t& m, Stamp arrival, Nav* nav);

/// False, and `integrity` untouched, if a protection level is negative or not a number.
[[nodiscard]] bool read_integrity(const integrity_t& m, Stamp arrival, Integrity* integrity);

/// None if the fix is invalid.
[[nodiscard]] std::optional<GpsPosition> read_fix(const gps_fix_t& m, Stamp arrival);

/// The points of a path with speeds, in frame local, on the ground or at `height_m` where that is
/// not known.
/// @param now  the vehicle is at the first point
void write_plan(const Path& path, const vj::Terrain& terrain, double height_m, Stamp now,
                plan_t* plan);

/// False, and `terrain` untouched, if the patch is invalid. Frame local.
[[nodiscard]] bool read_terrain(const map_patch_t& m, vj::Terrain* terrain);

}  // namespace rcs::bg

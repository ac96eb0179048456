#pragma once
// The terrain in the message shell of WM: receives the points of SP, publishes the patch ahead.

#include <optional>
#include <vector>

#include "lcmtypes/rcs/map_patch_t.hpp"
#include "lcmtypes/rcs/points_t.hpp"
#include "modules/wm/estimator.h"
#include "modules/wm/terrain/moving_objects.h"
#include "modules/wm/terrain/terrain_grid.h"
#include "modules/wm/wm_config.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/report.h"

namespace rcs::wm {

class TerrainServer {
 public:
  TerrainServer(const WmConfig& config, Bus* bus);

  /// Once a cycle: computes a part of a patch, or inserts the points received. New points wait for
  /// the end of a patch, so that all of it is of one moment.
  /// @param local_began  identifies frame local
  void step(const Estimator& estimator, Stamp local_began, Stamp now, Report* report);

  /// Another frame local has begun.
  void clear();

  [[nodiscard]] const InboxBase& inbox() const { return points_; }

  [[nodiscard]] const TerrainGrid& grid() const { return grid_; }
  [[nodiscard]] TerrainGrid& grid() { return grid_; }
  /// Reference instant of the newest scan in the grid.
  [[nodiscard]] Stamp newest_points() const { return newest_points_; }
  void restore_newest_scan(Stamp newest_points, Stamp scanned) {
    newest_points_ = newest_points;
    scanned_ = scanned;
  }
  /// Node time at which the newest scan was inserted, min(): none; stamps of sensors may be of
  /// another clock.
  [[nodiscard]] Stamp scanned() const { return scanned_; }
  /// Of a grid that was restored for a vehicle that may have been moved.
  struct Restored {
    Pose T_local_vehicle;  ///< in the frame of the grid, at rest
    Stamp until{};         ///< of its use
  };
  /// The first scan decides whether the terrain ahead of the vehicle is used, which is moved to the
  /// present frame; no patch is published before.
  void verify_restored(const Restored& restored) { restored_ = restored; }
  /// Whether this is still to be decided.
  [[nodiscard]] bool restored() const { return restored_.has_value(); }

 private:
  void accept(const points_t& m, const Estimator& estimator, Stamp now, Report* report);
  void begin_patch(const Pose& T_local_vehicle, Stamp local_began);
  void continue_patch();
  void publish_patch();
  void follow_objects(const points_t& m);
  void mark_motion();
  void verify(const Pose& T_local_points, const Estimator& estimator, Stamp now, Report* report);

  Inbox<points_t> points_;
  Outbox<map_patch_t> patches_;
  TerrainGrid grid_;
  MovingObjects moving_;
  std::vector<Cell> upright_;  // of the parts of a scan
  std::int64_t moving_scan_ = -1;
  PeriodicClock clock_;
  Stamp newest_points_ = Stamp::min();  // reference instant of the newest scan in grid_
  int rows_;  // computed so far of the patch that was begun; all: none is begun
  map_patch_t patch_{};
  Points p_vehicle_;
  std::optional<Restored> restored_;
  Stamp scanned_ = Stamp::min();
  std::vector<TerrainAnswer> answers_;
};

}  // namespace rcs::wm

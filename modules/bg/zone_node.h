#pragma once
// Zones in the shell of BG: where frame world is, what is forbidden there, and the texts about it.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/gps_fix_t.hpp"
#include "modules/bg/bg_messages_node.h"
#include "modules/bg/body.h"
#include "modules/bg/decide.h"
#include "modules/bg/zone_ground.h"
#include "modules/bg/zone_guard.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/zones/zone_file.h"

namespace rcs::bg {

/// The zones of the vehicle. Without zones every function does nothing. Allocates nothing after the
/// first cycles, except for another datum of frame world.
class ZoneWatch {
 public:
  ZoneWatch(GeodeticZones zones, const Shape& shape, Bus* bus);

  /// GPS_FIX: of a vehicle whose heading is unknown, WM publishes no position in frame world. Null:
  /// it is not received, as nothing is forbidden.
  [[nodiscard]] const InboxBase* inbox() const { return fixes_ ? &*fixes_ : nullptr; }

  /// Once a cycle, after the messages were received.
  /// @param initializes_heading  the vehicle drives ahead because frame world is not known yet
  void update(const Nav& nav, const Integrity& integrity, bool initializes_heading, Stamp now);

  /// Marks forbidden ground as obstacles; terrain and vehicle are in the frame local of the last
  /// update().
  void mark(const Pose2d& vehicle, vj::Terrain* terrain);
  /// The same for the remembered ground; null: nothing is marked.
  [[nodiscard]] const std::vector<std::uint8_t>* forbidden(const RememberedGround& ground,
                                                           double body_m);
  /// There is a fence or a keep-out.
  [[nodiscard]] bool forbids() const { return fixes_.has_value(); }
  /// The terrain is of another frame local: nothing is marked in it.
  void unmark() { marked_ = false; }

  /// Why a waypoint of a route cannot be reached; empty: none is forbidden, or frame world is not
  /// known yet. Valid until the next call.
  [[nodiscard]] std::string_view objection(const Route& route, const Nav& nav);

  /// Sets the limits of a path in frame local, see PathPoint::zone_mps and road_mps.
  void limit_speeds(Path* path) const;

  /// Sets the facts about zones. The reason is valid until the next update().
  /// @param at  index of the point of the path at which the vehicle is
  void describe(const Path& path, std::size_t at, Facts* facts) const;

 private:
  /// The state of the vehicle, as far as it does not depend on the terrain and the path.
  enum class Position {
    kFree,
    kUnknown,
    kWithoutFix,  ///< it initializes its heading
    kNearWithoutHeading,
    kUnbounded,
    kNear,
    kInside
  };
  void follow_datum(const Geodetic& datum);
  void take_fixes();
  void watch_position(const Nav& nav);
  /// Of a vehicle that initializes its heading: only GPS gives its position.
  void watch_fix(Stamp now);
  /// @param zone  that is named; null: none
  void set(Position position, const Zone* zone);

  GeodeticZones drawn_;
  Body body_;
  std::optional<Inbox<gps_fix_t>> fixes_;
  std::optional<LocalFrame> world_;  // of zones_
  Zones zones_;
  ZoneGround ground_;
  ZoneGuard guard_;
  std::optional<GpsPosition> fix_;
  std::optional<LocalFromWorld> local_from_world_;  // while the pose in frame world is valid
  double level_m_ = 0.0;                            // horizontal protection level; infinite: none
  bool marked_ = false;                             // the terrain
  bool by_fix_ = false;
  std::int32_t world_resets_ = 0;
  Position position_ = Position::kFree;
  const Zone* named_ = nullptr;  // in reason_
  std::string reason_;
  std::string objection_;
  double slowest_mps_;  // of all speed zones; infinite: there is none
};

}  // namespace rcs::bg

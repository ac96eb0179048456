#pragma once
// Commands of operators as received, and their validation.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "rcs/base/linear.h"
#include "rcs/base/stamp.h"

namespace rcs::gateway {

struct Waypoint {
  Vec3 p_m = Vec3::Zero();
  double radius_m = 0.0;
  double speed_mps = 0.0;
};

/// Ids count microseconds since 1970, and this is the year 2100: a larger id would make all later
/// ids of its operator stale.
constexpr std::int64_t kMaxCommandId = 4'102'444'800'000'000;
constexpr int kKindHalt = 0;
constexpr int kKindGoto = 1;
constexpr int kKindFollow = 2;
constexpr int kKindReturn = 3;
constexpr int kFrameWorld = 0;
constexpr int kFrameLocal = 1;

struct WaypointCommand {
  std::string operator_id;  ///< operator of the writer's partition; empty: not authorized
  std::int64_t command_id = 0;
  int kind = kKindHalt;
  int frame = kFrameWorld;
  Duration valid_for{};
  std::vector<Waypoint> waypoints;
};

struct StopCommand {
  std::string operator_id;  ///< as above
  std::int64_t command_id = 0;
  bool engage = true;
};

struct Limits {
  bool tasks = false;                          ///< commands are tasks of the mission
  int max_waypoints = 64;                      ///< of one command
  Duration min_valid_for = from_seconds(0.5);  ///< a shorter one could not be renewed in time
  Duration max_valid_for =
      from_seconds(5.0);  ///< bounds the motion after an operator falls silent, >= min
  double max_speed_mps = 15.0;
  double min_radius_m = 0.1;          ///< of a waypoint
  double max_radius_m = 100.0;        ///< >= min
  double max_position_m = 100'000.0;  ///< of a waypoint from the origin of its frame
};

enum class Refusal {
  kNone,
  kOperator,
  kCommandId,
  kStale,
  kChanged,
  kKind,
  kNoMission,
  kFrame,
  kTaskFrame,
  kValidFor,
  kCount,
  kNotFinite,
  kPosition,
  kRadius,
  kSpeed,
  kStopped,
  kHeld,
};
constexpr std::size_t kRefusals = 17;

[[nodiscard]] std::string_view text(Refusal refusal);

[[nodiscard]] bool is_command_id(std::int64_t id);

/// 1 to 32 letters, digits, '_' or '-'.
[[nodiscard]] bool is_name(std::string_view name);

/// Validates a command without its predecessors. A halt is checked for its operator and id only:
/// nothing else may prevent a vehicle from stopping.
[[nodiscard]] Refusal check(const WaypointCommand& command, const Limits& limits);

}  // namespace rcs::gateway

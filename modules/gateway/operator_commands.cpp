#include "modules/gateway/operator_commands.h"

#include <algorithm>
#include <cmath>

namespace rcs::gateway {
namespace {

Refusal check(const Waypoint& w, const Limits& limits) {
  if (!w.p_m.allFinite() || !std::isfinite(w.radius_m) || !std::isfinite(w.speed_mps)) {
    return Refusal::kNotFinite;
  }
  if (w.p_m.cwiseAbs().maxCoeff() > limits.max_position_m) return Refusal::kPosition;
  if (w.radius_m < limits.min_radius_m || w.radius_m > limits.max_radius_m) return Refusal::kRadius;
  if (w.speed_mps <= 0.0 || w.speed_mps > limits.max_speed_mps) return Refusal::kSpeed;
  return Refusal::kNone;
}

bool is_name_char(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-';
}

}  // namespace

std::string_view text(Refusal refusal) {
  constexpr std::string_view kTexts[kRefusals] = {
      "none",
      "the partition of the writer is not the name of the operator",
      "command_id is not in [1, 4102444800000000]",
      "the command_id is older than the last one, or has ended",
      "the content differs under the same command_id",
      "unknown kind",
      "a task, but the gateway of this vehicle commands no mission",
      "unknown frame",
      "a task that is not in frame WORLD",
      "valid_for out of range",
      "number of waypoints out of range",
      "a number is not finite",
      "a waypoint is too far from the origin of its frame",
      "the radius of a waypoint is out of range",
      "the speed of a waypoint is out of range",
      "an emergency stop is engaged",
      "another operator is in command",
  };
  return kTexts[static_cast<std::size_t>(refusal)];
}

bool is_command_id(std::int64_t id) { return id > 0 && id <= kMaxCommandId; }

bool is_name(std::string_view name) {
  return !name.empty() && name.size() <= 32 && std::all_of(name.begin(), name.end(), is_name_char);
}

Refusal check(const WaypointCommand& command, const Limits& limits) {
  if (!is_name(command.operator_id)) return Refusal::kOperator;
  if (!is_command_id(command.command_id)) return Refusal::kCommandId;
  if (command.kind == kKindHalt) return Refusal::kNone;
  if (command.kind < kKindGoto || command.kind > kKindReturn) return Refusal::kKind;
  if (command.kind != kKindGoto && !limits.tasks) return Refusal::kNoMission;
  if (command.frame != kFrameWorld && command.frame != kFrameLocal) return Refusal::kFrame;
  if (command.valid_for < limits.min_valid_for || command.valid_for > limits.max_valid_for) {
    return Refusal::kValidFor;
  }
  const std::size_t n = command.waypoints.size();
  if (command.kind == kKindReturn) return n == 0 ? Refusal::kNone : Refusal::kCount;
  if (limits.tasks && command.frame != kFrameWorld) return Refusal::kTaskFrame;
  if (n < 1 || n > static_cast<std::size_t>(limits.max_waypoints)) return Refusal::kCount;
  for (const Waypoint& w : command.waypoints) {
    if (const Refusal refusal = check(w, limits); refusal != Refusal::kNone) return refusal;
  }
  return Refusal::kNone;
}

}  // namespace rcs::gateway

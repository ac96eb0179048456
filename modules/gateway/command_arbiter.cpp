#include "modules/gateway/command_arbiter.h"

#include <algorithm>

namespace rcs::gateway {
namespace {

// A shorter validity is useless: a cycle of the gateway and one of BG.
constexpr Duration kShortest = from_milliseconds(100.0);

bool same(const Waypoint& a, const Waypoint& b) {
  return a.p_m == b.p_m && a.radius_m == b.radius_m && a.speed_mps == b.speed_mps;
}

bool same_content(const WaypointCommand& a, const WaypointCommand& b) {
  return a.kind == b.kind && a.frame == b.frame &&
         std::equal(a.waypoints.begin(), a.waypoints.end(), b.waypoints.begin(), b.waypoints.end(),
                    same);
}

}  // namespace

Refusal CommandArbiter::accept(const WaypointCommand& command, Stamp now) {
  if (const Refusal refusal = check(command, params_.limits); refusal != Refusal::kNone) {
    return refusal;
  }
  Operator* const from = find(command.operator_id, now);
  if (from == nullptr) return Refusal::kStopped;  // no record is free only if all are engaged
  from->received = now;

  if (command.command_id == from->last_command) {
    if (command.kind == kKindHalt && from->last_was_halt) return Refusal::kNone;
    const bool stands =
        (phase_ == Phase::kGoto || phase_ == Phase::kDone || phase_ == Phase::kFailed) &&
        who_ == command.operator_id && which_ == command.command_id;
    if (!stands) return Refusal::kStale;
    if (!same_content(command, standing_)) return Refusal::kChanged;
    standing_.valid_for = command.valid_for;
    standing_received_ = now;
    return Refusal::kNone;
  }
  if (command.command_id < from->last_command) return Refusal::kStale;

  // The id is consumed even if the command is rejected: otherwise the command would take effect
  // later, when a stop is released or the other operator falls silent.
  from->last_command = command.command_id;
  from->last_was_halt = command.kind == kKindHalt;
  const bool stopped = phase_ == Phase::kStopped || phase_ == Phase::kReleasing;
  if (command.kind == kKindHalt) {
    if (!stopped) enter(Phase::kHalted, command.operator_id, command.command_id);
    return Refusal::kNone;
  }
  if (stopped) return Refusal::kStopped;
  if (phase_ == Phase::kGoto && who_ != command.operator_id) return Refusal::kHeld;
  standing_ = command;
  standing_received_ = now;
  enter(Phase::kGoto, command.operator_id, command.command_id);
  return Refusal::kNone;
}

Refusal CommandArbiter::accept(const StopCommand& command, Stamp now) {
  Operator* const from = is_name(command.operator_id) ? find(command.operator_id, now) : nullptr;
  if (command.engage) {
    if (from == nullptr) {
      unnamed_engaged_ = true;
    } else {
      from->received = now;
      from->engaged = true;
      // Any id engages a stop, but only a valid one updates the id that a release is compared with.
      if (is_command_id(command.command_id)) {
        from->last_stop = std::max(from->last_stop, command.command_id);
      }
    }
    if (phase_ != Phase::kStopped) {
      enter(Phase::kStopped, from == nullptr ? "" : command.operator_id, command.command_id);
    }
    return Refusal::kNone;
  }
  if (from == nullptr) return Refusal::kOperator;
  if (!is_command_id(command.command_id)) return Refusal::kCommandId;
  if (command.command_id <= from->last_stop) {
    const bool repeated = command.command_id == from->last_stop && !from->engaged;
    return repeated ? Refusal::kNone : Refusal::kStale;
  }
  from->received = now;
  from->engaged = false;
  from->last_stop = command.command_id;
  unnamed_engaged_ = false;
  if (phase_ != Phase::kStopped || any_engaged()) return Refusal::kNone;
  releasing_since_ = now;
  enter(Phase::kReleasing, command.operator_id, command.command_id);
  return Refusal::kNone;
}

void CommandArbiter::adopt_stop(std::string_view operator_id, Stamp now) {
  Operator* const from = is_name(operator_id) ? find(operator_id, now) : nullptr;
  (from == nullptr ? unnamed_engaged_ : from->engaged) = true;
  if (phase_ != Phase::kStopped) {
    enter(Phase::kStopped, from == nullptr ? std::string_view() : operator_id, 0);
  }
}

void CommandArbiter::end_stop(std::string_view operator_id) {
  if (operator_id.empty()) unnamed_engaged_ = false;
  for (Operator& o : operators_) {
    if (!operator_id.empty() && o.id == operator_id) o.engaged = false;
  }
  if (phase_ == Phase::kStopped && !any_engaged()) enter(Phase::kIdle, "", 0);
}

std::vector<std::string_view> CommandArbiter::engaged() const {
  std::vector<std::string_view> names;
  if (unnamed_engaged_) names.emplace_back();
  for (const Operator& o : operators_) {
    if (o.engaged) names.emplace_back(o.id);
  }
  return names;
}

std::optional<Action> CommandArbiter::decide(Stamp now, Progress progress) {
  // Before the progress: a vehicle that stops because its operator is silent has not failed.
  if (phase_ == Phase::kGoto && now >= standing_received_ + standing_.valid_for) {
    phase_ = Phase::kSilent;
  }
  if (sent_) take_progress(progress, now);
  switch (phase_) {
    case Phase::kStopped:
      if (sent_ && now - sent_at_ < params_.refresh) return std::nullopt;
      return send(Action::Kind::kEmergencyStop, params_.valid_for, now);
    case Phase::kReleasing:
      if (sent_ && now - sent_at_ < params_.refresh) return std::nullopt;
      return send(Action::Kind::kRelease, params_.valid_for, now);
    case Phase::kHalted:
      if (sent_) return std::nullopt;
      return send(Action::Kind::kHalt, params_.valid_for, now);
    case Phase::kGoto:
      return keep_fresh(now);
    case Phase::kIdle:
    case Phase::kDone:
    case Phase::kFailed:
    case Phase::kSilent:
      break;
  }
  return std::nullopt;
}

void CommandArbiter::take_progress(Progress progress, Stamp now) {
  if (phase_ == Phase::kGoto && progress != Progress::kUnderway) {
    phase_ = progress == Progress::kDone ? Phase::kDone : Phase::kFailed;
  } else if (phase_ == Phase::kReleasing && progress == Progress::kDone) {
    enter(Phase::kIdle, "", 0);
  } else if (phase_ == Phase::kReleasing && now - releasing_since_ > params_.release_patience) {
    // BG still reports the stop, so the gateway does: a new release is required.
    unnamed_engaged_ = true;
    enter(Phase::kStopped, "", 0);
  }
}

// Never valid for longer than the command of the operator: a silence ends it within valid_for of
// the last sample, even if this process fails.
std::optional<Action> CommandArbiter::keep_fresh(Stamp now) {
  const Stamp until = std::min(now + params_.valid_for, standing_received_ + standing_.valid_for);
  if (until - now < kShortest) return std::nullopt;
  if (sent_) {
    const Duration gain = until - sent_until_;
    const bool runs_out = sent_until_ - now < params_.refresh / 2;
    if (gain < params_.refresh && !(runs_out && gain >= kShortest)) return std::nullopt;
  }
  return send(Action::Kind::kGoto, until - now, now);
}

Action CommandArbiter::send(Action::Kind kind, Duration valid_for, Stamp now) {
  sent_ = true;
  sent_at_ = now;
  sent_until_ = now + valid_for;
  return {kind, valid_for, kind == Action::Kind::kGoto ? &standing_ : nullptr};
}

void CommandArbiter::enter(Phase phase, std::string_view who, std::int64_t which) {
  phase_ = phase;
  who_ = who;
  which_ = which;
  sent_ = false;
}

bool CommandArbiter::any_engaged() const {
  return unnamed_engaged_ || std::any_of(operators_.begin(), operators_.end(),
                                         [](const Operator& o) { return o.engaged; });
}

// The record of an operator, created if there is none in place of the one that was silent longest.
// Null: all are engaged. Forgetting is safe, because authentication prevents the replay of old
// samples.
CommandArbiter::Operator* CommandArbiter::find(std::string_view id, Stamp now) {
  Operator* oldest = nullptr;
  for (Operator& o : operators_) {
    if (o.id == id) return &o;
    const bool in_command = phase_ == Phase::kGoto && o.id == who_;
    if (o.engaged || in_command) continue;
    if (oldest == nullptr || o.received < oldest->received) oldest = &o;
  }
  if (oldest == nullptr) return nullptr;
  *oldest = Operator{};
  oldest->id = id;
  oldest->received = now;
  return oldest;
}

}  // namespace rcs::gateway

#pragma once
// Arbitrates the commands of the operators by content and age, and decides the action of the
// vehicle. One operator at a time is in command; anyone may stop. In doubt the vehicle stands
// still: after the silence of its operator, a stop, a failure or the end of a command, a new
// command is required.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "modules/gateway/operator_commands.h"
#include "rcs/base/stamp.h"

namespace rcs::gateway {

struct ArbiterParams {
  Limits limits;
  Duration refresh = from_seconds(1.0);            ///< interval at which a command to BG is renewed
  Duration valid_for = from_seconds(2.5);          ///< validity of a command to BG, > refresh
  Duration release_patience = from_seconds(10.0);  ///< time for BG to accept a release, > refresh
};

/// Progress of the newest action, as reported by BG.
enum class Progress { kUnderway, kDone, kError };

struct Action {
  enum class Kind { kHalt, kGoto, kEmergencyStop, kRelease };
  Kind kind = Kind::kHalt;
  Duration valid_for{};
  const WaypointCommand* command = nullptr;  ///< of a kGoto; valid until the next accept()
};

class CommandArbiter {
 public:
  enum class Phase {
    kIdle,
    kGoto,       ///< the command in force is renewed
    kDone,       ///< BG has completed it
    kFailed,     ///< BG cannot complete it
    kSilent,     ///< its operator is silent
    kHalted,     ///< by an operator
    kStopped,    ///< an emergency stop is engaged
    kReleasing,  ///< all stops are released; BG has not accepted the release yet
  };
  static constexpr std::size_t kOperators = 16;

  explicit CommandArbiter(const ArbiterParams& params) : params_(params) {}

  /// A new command, or a repetition, which keeps it valid.
  Refusal accept(const WaypointCommand& command, Stamp now);

  /// Engaging is never rejected, whatever the id: a stop of an unknown operator counts as unnamed,
  /// and the release of any known operator ends it. Otherwise a release ends only the stop of its
  /// own operator.
  Refusal accept(const StopCommand& command, Stamp now);

  /// A stop that a former process of the gateway has set is in force.
  void adopt_stop(std::string_view operator_id, Stamp now);
  /// It has been released without this operator.
  void end_stop(std::string_view operator_id);
  /// Operators whose stops are in force; an empty name: unknown ones.
  [[nodiscard]] std::vector<std::string_view> engaged() const;

  /// The action for BG, if one is due; once a cycle, after the commands of this cycle.
  /// @param progress  of the newest action
  std::optional<Action> decide(Stamp now, Progress progress);

  [[nodiscard]] Phase phase() const { return phase_; }
  /// Operator of the command or stop of the phase; empty: none, or an unknown operator.
  [[nodiscard]] std::string_view operator_id() const { return who_; }
  [[nodiscard]] std::int64_t command_id() const { return which_; }

 private:
  struct Operator {
    std::string id;
    std::int64_t last_command = 0;
    bool last_was_halt = false;
    std::int64_t last_stop = 0;
    bool engaged = false;
    Stamp received = Stamp::min();
  };

  Operator* find(std::string_view id, Stamp now);
  [[nodiscard]] bool any_engaged() const;
  void enter(Phase phase, std::string_view who, std::int64_t which);
  void take_progress(Progress progress, Stamp now);
  std::optional<Action> keep_fresh(Stamp now);
  Action send(Action::Kind kind, Duration valid_for, Stamp now);

  ArbiterParams params_;
  std::array<Operator, kOperators> operators_;
  bool unnamed_engaged_ = false;

  Phase phase_ = Phase::kIdle;
  std::string who_;
  std::int64_t which_ = 0;
  WaypointCommand standing_;
  Stamp standing_received_ = Stamp::min();  // newest repetition by its operator
  bool sent_ = false;                       // an action of this phase has been sent
  Stamp sent_at_ = Stamp::min();            // the newest of them
  Stamp sent_until_ = Stamp::min();
  Stamp releasing_since_ = Stamp::min();
};

}  // namespace rcs::gateway

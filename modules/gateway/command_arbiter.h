#pragma once
// Decides what the vehicle is told, from what operators ask and how long ago they were heard. One
// operator at a time is in command; anyone may stop. It errs on the side of standing still: an
// operator that falls silent, a stop, a failure or the end of a command each ask for a new command.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "modules/gateway/operator_commands.h"
#include "rcs/base/stamp.h"

namespace rcs::gateway {

struct DeskParams {
  Limits limits;
  Duration refresh = from_seconds(1.0);            ///< of what is sent to the vehicle
  Duration valid_for = from_seconds(2.5);          ///< of what is sent, > refresh
  Duration release_patience = from_seconds(10.0);  ///< a vehicle at rest takes a release, > refresh
};

/// How the newest action stands with the vehicle's behaviour generation.
enum class Progress { kUnderway, kDone, kError };

struct Action {
  enum class Kind { kHalt, kGoto, kEmergencyStop, kRelease };
  Kind kind = Kind::kHalt;
  Duration valid_for{};
  const WaypointOrder* order = nullptr;  ///< of a kGoto; valid until the next take()
};

class CommandDesk {
 public:
  enum class Phase {
    kIdle,
    kGoto,       ///< the standing command is kept fresh
    kDone,       ///< the vehicle has done it
    kFailed,     ///< the vehicle cannot do it
    kSilent,     ///< its operator fell silent
    kHalted,     ///< by an operator
    kStopped,    ///< an emergency stop is engaged
    kReleasing,  ///< all are released; the vehicle has not taken it yet
  };
  static constexpr std::size_t kOperators = 16;

  explicit CommandDesk(const DeskParams& params) : params_(params) {}

  /// A command, or the same one again, which keeps it alive.
  Refusal take(const WaypointOrder& order, Stamp now);

  /// To engage is never refused, whatever the id: a stop of an unknown operator counts as one
  /// without a name, which any known operator's release ends. A release ends the stop of its own
  /// operator only.
  Refusal take(const StopOrder& order, Stamp now);

  /// What to tell the vehicle now; once a cycle, after the orders of this cycle.
  /// @param progress  of the action that was decided last
  std::optional<Action> decide(Stamp now, Progress progress);

  [[nodiscard]] Phase phase() const { return phase_; }
  /// Whose command or stop the phase is about; empty: nobody's, or that of an unknown operator.
  [[nodiscard]] std::string_view operator_id() const { return who_; }
  [[nodiscard]] std::int64_t command_id() const { return which_; }

 private:
  struct Operator {
    std::string id;
    std::int64_t last_command = 0;
    bool last_was_halt = false;
    std::int64_t last_stop = 0;
    bool engaged = false;
    Stamp heard = Stamp::min();
  };

  Operator* find(std::string_view id, Stamp now);
  [[nodiscard]] bool any_engaged() const;
  void enter(Phase phase, std::string_view who, std::int64_t which);
  void take_progress(Progress progress, Stamp now);
  std::optional<Action> keep_fresh(Stamp now);
  Action send(Action::Kind kind, Duration valid_for, Stamp now);

  DeskParams params_;
  std::array<Operator, kOperators> operators_;
  bool unnamed_engaged_ = false;

  Phase phase_ = Phase::kIdle;
  std::string who_;
  std::int64_t which_ = 0;
  WaypointOrder standing_;
  Stamp standing_heard_ = Stamp::min();  // when its operator last repeated it
  bool sent_ = false;                    // an action of this phase has been sent
  Stamp sent_at_ = Stamp::min();         // the newest of them
  Stamp sent_until_ = Stamp::min();
  Stamp releasing_since_ = Stamp::min();
};

}  // namespace rcs::gateway

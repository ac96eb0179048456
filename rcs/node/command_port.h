#pragma once
// RCS's command and status protocol between a superior and its subordinate. Serials are per issuer
// and increase; the subordinate echoes the serial of the command in force. The superior derives the
// state of its command from (sent, echoed, age), so that the DONE of an older command is never
// attributed to the new one, and silence is an error. All stamps are of one computer's timeline.
// An emergency stop is exempt from every rule that could prevent its execution: it is sent until
// the subordinate lists it as persisted, and accepted with any serial, age and issuer. Other
// commands of another start of the computer are rejected.

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/stop_receiver.h"

namespace rcs {

/// A command of a superior, without serial and stamps.
struct Command {
  std::int8_t kind = command_t::KIND_HALT;
  std::int8_t frame = command_t::FRAME_WORLD;
  std::int32_t map_epoch = 0;  ///< of FRAME_ROLLING
  std::vector<waypoint_t> waypoints;
  /// A new command with the same number continues the task, also in a restarted subordinate:
  /// waypoints already reached are not driven to again. 0: the command does not continue another
  /// one.
  std::int64_t task = 0;
  /// Limits of the protection levels during this command; 0 or wider than configured: the
  /// subordinate's configured limits apply.
  double alert_limit_horizontal_m = 0.0;
  double alert_limit_vertical_m = 0.0;
  /// Of an emergency stop: commands with the same number repeat one stop, also after it has been
  /// released. 0: another stop.
  std::int64_t stop = 0;
  /// Of an emergency stop: for whom the port sets it. The issuer of the stop is "port:on_behalf".
  std::string on_behalf;
  /// Of a release: ids of the stops that it ends, see CommandPort::listed_stops().
  std::vector<std::int64_t> released;
  Duration valid_for = from_seconds(2.5);  ///< the subordinate stops after this time
};

/// State of the newest command of a port.
struct CommandProgress {
  enum class State { kIdle, kSent, kExecuting, kDone, kError };
  State state = State::kIdle;
  std::string_view reason;  ///< of an error; valid until the port's next step() or send()
};

struct CommandPortParams {
  Duration resend = from_milliseconds(200.0);  ///< interval, until it is echoed
  int max_sends = 8;  ///< of one command, the first included; an emergency stop has no limit
  Duration silence = from_milliseconds(500.0);  ///< a subordinate silent for longer has failed
};

/// The superior's end.
class CommandPort {
 public:
  /// @param issuer  unique for each port in the whole system
  CommandPort(Bus* bus, std::string_view command_channel, std::string_view stop_channel,
              std::string_view status_channel, std::string_view issuer,
              const CommandPortParams& params);

  /// Replaces the command that was sent before.
  /// @return its serial: larger than any that this issuer has used, also before a restart, because
  ///         serials start from the microseconds of the timeline
  std::int64_t send(const Command& command, Stamp now);

  /// Call it once a cycle: reads the statuses and sends the command again until it is echoed. An
  /// emergency stop is sent until the subordinate lists it as persisted: then it is in force and
  /// survives a restart of the subordinate.
  void step(Stamp now);

  [[nodiscard]] CommandProgress progress(Stamp now) const;
  /// The newest command has been echoed, even if another one has replaced it since; an emergency
  /// stop has been persisted.
  [[nodiscard]] bool confirmed() const { return echoed_; }
  /// The newest status, for the command of any superior; null before the first.
  [[nodiscard]] const status_t* status() const { return received_ ? &status_ : nullptr; }
  /// Ids of the emergency stops in force that `issuer` has set, also on behalf of others, by the
  /// newest status; empty name: all of them.
  [[nodiscard]] std::vector<std::int64_t> listed_stops(std::string_view issuer) const;
  /// The newest status lists the emergency stop of this Command::stop, which is not 0.
  [[nodiscard]] bool lists(std::int64_t stop) const;
  [[nodiscard]] const InboxBase& inbox() const { return statuses_; }

 private:
  /// Further numbers of stops displace the oldest one, which is then another stop.
  static constexpr std::size_t kStops = 64;
  struct NumberedStop {
    std::int64_t number = 0;
    std::int64_t id = 0;
  };
  void publish();
  [[nodiscard]] bool echoes_mine() const;
  [[nodiscard]] bool lists_id(std::int64_t id) const;
  [[nodiscard]] std::int64_t new_stop_id() const;
  [[nodiscard]] std::int64_t stop_id(std::int64_t number);

  CommandPortParams params_;
  Outbox<command_t> commands_;
  Outbox<command_t> stops_;
  Inbox<status_t> statuses_;
  command_t command_{};
  status_t status_{};
  bool received_ = false;
  Stamp received_at_ = Stamp::min();
  Stamp first_sent_ = Stamp::min();
  Stamp last_sent_ = Stamp::min();
  int sends_ = 0;
  bool echoed_ = false;  // the newest command has been echoed once; a stop: persisted
  bool done_ = false;    // and its DONE was received
  std::string issuer_;
  std::deque<NumberedStop> numbered_;
  std::int64_t stop_id_ = 0;  // of the last stop; 0: none yet
};

struct SubordinateParams {
  Duration longest = from_seconds(60.0);  ///< a command valid for longer is rejected
  /// Serials are microseconds of the timeline: one further ahead than this is rejected, because it
  /// would make all later commands of its issuer stale.
  Duration serial_ahead = from_seconds(1.0);
};

/// Content of the status of a subordinate.
struct StatusReport {
  std::int8_t status = status_t::STATUS_UNINITIALIZED;
  std::string_view state;
  int line = 0;  ///< source line of the decision
  std::string_view reason;
  int degrade_level = 0;
  int waypoints_done = 0;
  std::int8_t emergency_stop = status_t::STOP_NONE;
  const std::vector<stop_t>* stops = nullptr;  ///< in force; null: none
};

/// The subordinate's end.
class Subordinate {
 public:
  Subordinate(Bus* bus, std::string_view node, std::string_view command_channel,
              std::string_view stop_channel, std::string_view status_channel,
              const SubordinateParams& params);

  /// Counts of the commands by result.
  struct Account {
    std::int64_t taken = 0;
    std::int64_t repeated = 0;      ///< of the serial in force: sent again before the echo arrived
    std::int64_t stale = 0;         ///< an older serial than one already accepted, or a release
                                    ///< issued before the newest stop arrived
    std::int64_t expired = 0;       ///< valid_until had passed at arrival
    std::int64_t before_start = 0;  ///< issued before this subordinate ran: possibly executed
    std::int64_t other_boot = 0;    ///< of another start of the computer: a recording, or delayed
    std::int64_t implausible = 0;   ///< issued in the future, valid for too long, or with an
                                    ///< implausible serial or issuer
  };

  /// Call it once a cycle, first: accepts what has arrived. The first call is the subordinate's
  /// start. An emergency stop is accepted in the cycle in which it arrives, before any other
  /// command; the others wait for the next cycle, as do commands that follow a release. Stops and
  /// releases have their own channel: no number of other commands displaces one.
  /// @param only_stops  the command in force stays so unless another stop arrives
  void take(Stamp now, bool only_stops = false);
  /// The emergency stops that arrived for this cycle, also if they repeat stops in force.
  [[nodiscard]] const std::vector<stop_t>& stops() const { return stops_.taken(); }
  /// Call it in every cycle in which an emergency stop is in force: a task that was given before
  /// its release is over, also if its issuer goes on renewing it (Command::task).
  void end_tasks();
  /// The newest accepted command continues such a task: it must not be executed. Of a subordinate
  /// that restarts during the stop, this holds for the tasks that are renewed before the release.
  [[nodiscard]] bool task_ended() const { return task_ended_; }
  /// These stops have been released: late copies of them are ignored.
  void release_stops(const std::vector<std::int64_t>& ids) { stops_.release(ids); }

  /// A command was accepted in this cycle.
  [[nodiscard]] bool is_new() const { return is_new_; }
  /// The newest accepted command, whether still valid or not; null before the first.
  [[nodiscard]] const command_t* command() const { return in_force_ ? &command_ : nullptr; }
  /// A command is in force and valid; otherwise the subordinate must stop.
  [[nodiscard]] bool valid(Stamp now) const {
    return in_force_ && now < from_utime(command_.valid_until_utime);
  }

  /// Publishes the status of this cycle.
  void report(Stamp now, const StatusReport& report);

  [[nodiscard]] const Account& account() const { return account_; }
  [[nodiscard]] const InboxBase& inbox() const { return commands_; }
  [[nodiscard]] const InboxBase& stop_inbox() const { return releases_; }

 private:
  struct Issuer {
    std::string name;
    std::int64_t serial = 0;  // newest accepted
    Stamp issued = Stamp::min();
    std::int64_t task = 0;        // newest accepted that is not 0
    std::int64_t ended_task = 0;  // 0: none
  };
  [[nodiscard]] bool take_stop(bool only_new);
  bool take_from(Inbox<command_t>* inbox, Stamp now);
  [[nodiscard]] bool admit(const command_t& m, Stamp now);
  void note_task();
  Issuer* issuer(const command_t& m);

  SubordinateParams params_;
  std::int64_t boot_id_;
  Inbox<command_t> commands_;
  StopReceiver stops_;
  Inbox<command_t> releases_;  // on the channel of the stops
  Outbox<status_t> statuses_;
  std::optional<Stamp> start_;
  std::array<Issuer, 8> issuers_;
  Stamp forgotten_ = Stamp::min();  // newest command of any removed issuer
  command_t command_{};
  bool in_force_ = false;
  bool is_new_ = false;
  bool task_ended_ = false;
  Account account_;
  status_t status_{};
};

}  // namespace rcs

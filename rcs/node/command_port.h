#pragma once
// RCS's command and status protocol between a superior and its subordinate. Serials are per issuer
// and only grow; the subordinate echoes the one that it acts on. The superior works out how its
// command stands from (sent, echoed, age), so that a DONE of an older command is never taken for
// the new one's, and silence is an error. All stamps are of one computer's timeline.
// An emergency stop is exempt from every rule that could keep it from being acted on: it is sent
// until it is echoed, and accepted whatever its serial, age or issuer.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/command_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/inbox.h"
#include "rcs/node/bus/outbox.h"

namespace rcs {

/// What a superior asks for.
struct Order {
  std::int8_t kind = command_t::KIND_HALT;
  std::int8_t frame = command_t::FRAME_WORLD;
  std::vector<waypoint_t> waypoints;
  /// Asking for the same again, with the same number, goes on with it, also in a subordinate that
  /// has started anew: waypoints that were reached are not driven to again. 0: it does not continue
  /// any other.
  std::int64_t task = 0;
  /// Of the protection levels while this is executed; 0 or wider than configured: the
  /// subordinate's configured ones.
  double alert_limit_horizontal_m = 0.0;
  double alert_limit_vertical_m = 0.0;
  Duration valid_for = from_seconds(2.5);  ///< the subordinate stops when this is over
};

/// How the newest command of a port stands.
struct Standing {
  enum class State { kIdle, kSent, kExecuting, kDone, kError };
  State state = State::kIdle;
  std::string_view reason;  ///< of an error; valid until the port's next step() or send()
};

struct CommandPortParams {
  Duration resend = from_milliseconds(200.0);  ///< until it is echoed
  int max_sends = 8;  ///< of one command, the first included; an emergency stop has no limit
  Duration silence = from_milliseconds(500.0);  ///< a subordinate silent for longer has failed
};

/// The superior's end.
class CommandPort {
 public:
  /// @param issuer  one per port in the whole system
  CommandPort(Bus* bus, std::string_view command_channel, std::string_view status_channel,
              std::string_view issuer, const CommandPortParams& params);

  /// Replaces whatever was sent before.
  /// @return its serial: larger than any that this issuer has used, even before a restart, as it is
  ///         counted from the time line's microseconds
  std::int64_t send(const Order& order, Stamp now);

  /// Once a cycle: reads the statuses and sends again what is not echoed yet. An emergency stop is
  /// sent until its echo reports no error: then it is in force and outlives the subordinate. It is
  /// sent with a new serial if another command has replaced it before.
  void step(Stamp now);

  [[nodiscard]] Standing standing(Stamp now) const;
  /// The newest command has been echoed, even if another one has replaced it since; an emergency
  /// stop: without an error.
  [[nodiscard]] bool confirmed() const { return echoed_; }
  /// The newest status, whoever's command it echoes; null before the first.
  [[nodiscard]] const status_t* status() const { return heard_ ? &status_ : nullptr; }
  [[nodiscard]] const InboxBase& inbox() const { return statuses_; }

 private:
  [[nodiscard]] bool echoes_mine() const;

  CommandPortParams params_;
  Outbox<command_t> commands_;
  Inbox<status_t> statuses_;
  command_t command_{};
  status_t status_{};
  bool heard_ = false;
  Stamp heard_at_ = Stamp::min();
  Stamp first_sent_ = Stamp::min();
  Stamp last_sent_ = Stamp::min();
  int sends_ = 0;
  bool echoed_ = false;    // the newest command has been echoed once
  bool done_ = false;      // and its DONE was seen
  bool seen_ = false;      // it has been echoed once, perhaps with an error
  bool replaced_ = false;  // a stop that was echoed with errors only, before another command was
};

struct SubordinateParams {
  Duration longest = from_seconds(60.0);  ///< a command valid for longer is refused
  /// Serials are microseconds of the timeline: one further ahead than this is refused, as it would
  /// make all later commands of its issuer stale.
  Duration serial_ahead = from_seconds(1.0);
};

/// What a subordinate says of itself.
struct StatusReport {
  std::int8_t status = status_t::STATUS_UNINITIALIZED;
  std::string_view state;
  int line = 0;  ///< in the source, of the state that was decided
  std::string_view reason;
  int degrade_level = 0;
  int waypoints_done = 0;
  std::int8_t emergency_stop = status_t::STOP_NONE;
};

/// The emergency stops of a command channel. They have a receiver of their own, so that no number
/// of other commands can displace one before it is read.
class StopReceiver final : public Receiver {
 public:
  static constexpr std::size_t kMaxIssuer = 64;  ///< characters of an issuer's name; more are cut

  StopReceiver(Bus* bus, std::string_view channel) { bus->subscribe(channel, this); }
  StopReceiver(const StopReceiver&) = delete;
  StopReceiver& operator=(const StopReceiver&) = delete;
  ~StopReceiver() = default;

  /// The newest stop that has not been taken; null: none.
  [[nodiscard]] const command_t* pending() const { return pending_ ? &newest_ : nullptr; }
  /// Ends pending().
  /// @return false: a copy of a stop that was taken before
  bool take();
  /// Copies of the stops taken so far are ignored from now on.
  void release();

  /// Arrival of the newest stop that was no copy (node time); a release issued before is too old.
  [[nodiscard]] Stamp last_arrival() const { return last_arrival_; }

  void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept override;

 private:
  struct Record {
    std::string issuer;
    std::int64_t serial = 0;
    std::int64_t utime = 0;
    bool released = false;
    bool used = false;
  };
  [[nodiscard]] Record* find(const command_t& m);

  command_t scratch_{};
  command_t newest_{};
  bool pending_ = false;
  Stamp pending_arrival_ = Stamp::min();
  Stamp last_arrival_ = Stamp::min();
  // A copy of a stop that was displaced from here stops again: the safe side.
  std::array<Record, 16> records_;
  std::size_t next_record_ = 0;
};

/// The subordinate's end.
class Subordinate {
 public:
  Subordinate(Bus* bus, std::string_view node, std::string_view command_channel,
              std::string_view status_channel, const SubordinateParams& params);

  /// What became of the commands so far.
  struct Account {
    std::int64_t taken = 0;
    std::int64_t repeated = 0;      ///< of the serial in force: sent again before the echo came
    std::int64_t stale = 0;         ///< an older serial than one already taken, or a release issued
                                    ///< before the newest stop arrived
    std::int64_t expired = 0;       ///< valid_until had passed when it came
    std::int64_t before_start = 0;  ///< issued before this subordinate ran: it may have been done
    std::int64_t implausible = 0;   ///< issued in the future, valid for too long, serial or issuer
                                    ///< that no superior has
  };

  /// Once a cycle, first: accepts what has arrived. The first call is the subordinate's start. An
  /// emergency stop is accepted in the cycle in which it arrives, before any other command, and the
  /// others wait for the next cycle, as do those behind a release.
  void take(Stamp now);
  /// The emergency stops accepted so far have been released: late copies of them do not stop again.
  void release_stops() { stops_.release(); }

  /// Taken in this very cycle.
  [[nodiscard]] bool is_new() const { return is_new_; }
  /// The newest command taken, whether still valid or not; null before the first.
  [[nodiscard]] const command_t* command() const { return in_force_ ? &command_ : nullptr; }
  /// A command is in force and valid: what to do otherwise is to stop.
  [[nodiscard]] bool valid(Stamp now) const {
    return in_force_ && now < from_utime(command_.valid_until_utime);
  }

  /// Publishes the status of this cycle.
  void report(Stamp now, const StatusReport& report);

  [[nodiscard]] const Account& account() const { return account_; }
  [[nodiscard]] const InboxBase& inbox() const { return commands_; }

 private:
  struct Issuer {
    std::string name;
    std::int64_t serial = 0;  // newest taken
    Stamp issued = Stamp::min();
  };
  void take_stop();
  [[nodiscard]] bool admit(const command_t& m, Stamp now);
  Issuer* issuer(const command_t& m);

  SubordinateParams params_;
  Inbox<command_t> commands_;
  StopReceiver stops_;
  Outbox<status_t> statuses_;
  std::optional<Stamp> start_;
  std::array<Issuer, 8> issuers_;
  Stamp forgotten_ = Stamp::min();  // newest command of any issuer that made room for another
  command_t command_{};
  bool in_force_ = false;
  bool is_new_ = false;
  Account account_;
  status_t status_{};
};

}  // namespace rcs

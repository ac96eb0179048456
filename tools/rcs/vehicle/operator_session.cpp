#include "tools/rcs/vehicle/operator_session.h"

#include <fmt/format.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cstdio>

#include "lcmtypes/channels.h"
#include "tools/rcs/command.h"
#include "tools/rcs/standard_streams.h"
#include "tools/rcs/terminal.h"

namespace rcs::cli {
namespace {

constexpr Duration kTick = from_milliseconds(100.0);

CommandPortParams params(const CommandedNode& node) {
  CommandPortParams p;
  p.silence = node.silence;
  return p;
}

}  // namespace

// BG stops 2.5 s after the last repetition of a command.
const CommandedNode kBgNode{"rcs go",
                            "BG",
                            channel::kBgCommand,
                            channel::kBgStatus,
                            from_seconds(1.0),
                            from_milliseconds(500.0),
                            from_seconds(2.5)};
// The mission reports once a second: a command must not be replaced before its echo.
const CommandedNode kMissionNode{
    "rcs mission",     "mission",         channel::kMissionCommand, channel::kMissionStatus,
    from_seconds(4.0), from_seconds(2.5), from_seconds(4.0)};

std::string_view name_of(CommandProgress::State state) {
  switch (state) {
    case CommandProgress::State::kIdle:
      return "idle";
    case CommandProgress::State::kSent:
      return "sent";
    case CommandProgress::State::kExecuting:
      return "executing";
    case CommandProgress::State::kDone:
      return "done";
    case CommandProgress::State::kError:
      break;
  }
  return "error";
}

OperatorSession::OperatorSession(LcmBus* bus, const CommandedNode& node)
    : node_(node),
      timeline_(bus, &stop_),
      port_(bus, node.command_channel, channel::kBgStop, node.status_channel, "operator",
            params(node)),
      nav_states_(bus, channel::kWmNavState, 1),
      terminal_(::isatty(STDERR_FILENO) == 1) {}

std::string OperatorSession::of_node(std::string_view reason) const {
  return reason.empty() ? fmt::format("{} reports an error", node_.name)
                        : fmt::format("{}: {}", node_.name, reason);
}

bool OperatorSession::wait() {
  const Stamp until = now() + kTick;
  Timeline::Step step = Timeline::Step::kDelivered;
  while (step == Timeline::Step::kDelivered) step = timeline_.advance(until);
  port_.step(now());
  if (step != Timeline::Step::kEnded) return true;
  // Consumed from its descriptor, so that the timeline continues.
  signalfd_siginfo signal{};
  if (::read(stop_.fd(), &signal, sizeof signal) == sizeof signal) note_interrupt();
  return false;
}

const nav_state_t* OperatorSession::belief() {
  const Stamp end = now() + from_seconds(1.0);
  while (now() < end && wait()) {
    const nav_state_t* const m = nav_states_.latest();
    if (m != nullptr && m->world_valid != 0) return m;
  }
  return nullptr;
}

Ending OperatorSession::pursue(rcs::Command command, Duration most, Duration patience) {
  const Stamp begin = now();
  command.task = to_utime(begin);
  command.valid_for = 2 * node_.repeat + node_.repeat / 2;
  Stamp next_send = begin;
  std::optional<Stamp> error_since;
  for (;;) {
    if (now() >= next_send) {
      port_.send(command, now());
      next_send = now() + node_.repeat;
    }
    if (!wait()) return {false, "interrupted", "interrupted"};
    if (const status_t* const s = port_.status();
        s != nullptr && s->emergency_stop != status_t::STOP_NONE) {
      return {
          false, "error",
          of_node(
              "an emergency stop is latched; release it at rest first, then give a new command")};
    }
    const CommandProgress current = port_.progress(now());
    show(current, now() - begin);
    if (current.state == CommandProgress::State::kDone) return {true, "done", ""};
    if (current.state == CommandProgress::State::kExecuting) error_since.reset();
    if (current.state == CommandProgress::State::kError) {
      if (!error_since) error_since = now();
      if (now() - *error_since >= patience) {
        return {false, "error", of_node(current.reason)};
      }
    }
    if (now() - begin >= most) return {false, "timeout", "the time limit is exceeded"};
  }
}

Ending OperatorSession::send_once(rcs::Command command) {
  const Duration patience = node_.patience;
  const bool release = command.kind == command_t::KIND_RELEASE;
  if (release) {
    const Stamp end = now() + patience;
    while (port_.status() == nullptr && now() < end) {
      if (!wait()) return {false, "interrupted", "interrupted"};
    }
    command.released = port_.listed_stops("");
  }
  const std::int64_t serial = port_.send(command, now());
  const Stamp begin = now();
  while (now() - begin < patience) {
    if (!wait()) return {false, "interrupted", "interrupted"};
    const CommandProgress current = port_.progress(now());
    // Its echo may have been replaced by that of a command of another superior.
    if (current.state == CommandProgress::State::kDone) return {true, "done", ""};
    const status_t* const status = port_.status();
    const bool echoed = status != nullptr && status->echo_serial == serial;
    if (!echoed || (release && current.state == CommandProgress::State::kExecuting)) continue;
    if (current.state != CommandProgress::State::kError) {
      return {true, std::string(name_of(current.state)), ""};
    }
    return {false, "error", of_node(current.reason)};
  }
  return {false, "error", of_node(port_.progress(now()).reason)};
}

Ending OperatorSession::emergency_stop(Duration most) {
  rcs::Command command;
  command.kind = command_t::KIND_EMERGENCY_STOP;
  const Stamp begin = now();
  port_.send(command, begin);
  for (;;) {
    const bool goes_on = wait();
    // Another command may have replaced it since: its progress is of no interest then.
    if (port_.confirmed()) return {true, "confirmed", ""};
    const CommandProgress current = port_.progress(now());
    show(current, now() - begin);
    if (goes_on && now() - begin < most) continue;
    return {false, goes_on ? "timeout" : "interrupted",
            "emergency stop not confirmed: " + of_node(current.reason)};
  }
}

void OperatorSession::end_line() {
  if (terminal_ && !shown_.empty()) fmt::print(stderr, "\n");
  shown_.clear();
}

// On a terminal one line that is overwritten; elsewhere a new line for each change.
void OperatorSession::show(const CommandProgress& current, Duration since) {
  // An error that lasts ends the command, which reports it: the node may be starting.
  const bool error = current.state == CommandProgress::State::kError;
  const std::string text = fmt::format("{}{}{}{}{}", error ? "waiting" : name_of(current.state),
                                       state().empty() ? "" : ", ", state(),
                                       current.reason.empty() ? "" : ": ", current.reason);
  if (terminal_) {
    replace_line(fmt::format("{}: {:5.1f} s  {}", node_.program, seconds(since), text));
  } else if (text != shown_ && current.state != CommandProgress::State::kSent) {
    fmt::print(stderr, "{}: {:5.1f} s  {}\n", node_.program, seconds(since), text);
  } else {
    return;
  }
  shown_ = text;
}

}  // namespace rcs::cli

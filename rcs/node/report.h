#pragma once
// Events of a node for people and programs: event_t on <NAME>_EVENT, at most one per code and
// interval, with the number of repetitions. Of changes of state, at most ten, so that the last one
// is published, too. The codes are those of lcmtypes/events.h. Nothing is printed here;
// EventPrinter prints events on a terminal.

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/events.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/bus.h"
#include "rcs/node/bus/outbox.h"
#include "rcs/node/process/terminal_line.h"

namespace rcs {

/// "sp" and "EVENT" give "SP_EVENT".
[[nodiscard]] std::string channel_of(std::string_view node, std::string_view suffix);

class Report {
 public:
  /// @param interval  of the timeline, between two messages of the same code
  Report(Bus* bus, std::string_view node, Duration interval);

  /// Publishes an event of lcmtypes/events.h, whose severity and limit are stated there.
  /// @param now   of the timeline (Cycle::now)
  /// @param text  names the object, the value, the limit and the consequence
  template <class... Args>
  void publish(Stamp now, const event::Info& event, fmt::format_string<Args...> text,
               const Args&... args) {
    send(now, event, event.severity, text, fmt::make_format_args(args...));
  }
  /// The end of a state whose beginning is an event: the same code with severity INFO.
  template <class... Args>
  void publish_end(Stamp now, const event::Info& event, fmt::format_string<Args...> text,
                   const Args&... args) {
    send(now, event, event::Severity::kInfo, text, fmt::make_format_args(args...));
  }

 private:
  struct Code {
    std::string_view name;
    Stamp window_begin;
    int sent = 0;               // in the window
    std::int64_t repeated = 0;  // not sent since the last message
  };

  void send(Stamp now, const event::Info& event, event::Severity severity, fmt::string_view text,
            fmt::format_args args);

  Outbox<event_t> outbox_;
  Duration interval_;
  std::vector<Code> codes_;
  event_t message_{};
};

/// Prints a node's events to stderr, one line each, with the time of day and the time since the
/// construction of the printer. Live only: it reads the clock.
class EventPrinter final : public Receiver {
 public:
  EventPrinter(Bus* bus, std::string_view node);
  void receive(const std::uint8_t* data, std::size_t size, Stamp arrival) noexcept override;

 private:
  event_t event_{};
  TerminalLines lines_;
  std::int64_t start_utime_;  // wall clock
};

}  // namespace rcs

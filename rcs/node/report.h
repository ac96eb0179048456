#pragma once
// Events of a node for people and programs: event_t on <NAME>_EVENT, at most one per code and
// interval, with the number of repetitions. Of changes of state, at most ten, so that the last one
// is published, too. Nothing is printed here; EventPrinter prints events on a terminal.

#include <fmt/format.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "lcmtypes/rcs/event_t.hpp"
#include "rcs/base/stamp.h"
#include "rcs/node/bus/bus.h"
#include "rcs/node/bus/outbox.h"

namespace rcs {

/// "sp" and "EVENT" give "SP_EVENT".
[[nodiscard]] std::string channel_of(std::string_view node, std::string_view suffix);

class Report {
 public:
  /// @param interval  of the timeline, between two messages of the same code
  Report(Bus* bus, std::string_view node, Duration interval);

  /// @param now   of the timeline (Cycle::now)
  /// @param code  a literal, stable, for programs: "map.reseeded"
  template <class... Args>
  void info(Stamp now, std::string_view code, fmt::format_string<Args...> text,
            const Args&... args) {
    send(now, event_t::SEVERITY_INFO, code, 1, text, fmt::make_format_args(args...));
  }
  template <class... Args>
  void warn(Stamp now, std::string_view code, fmt::format_string<Args...> text,
            const Args&... args) {
    send(now, event_t::SEVERITY_WARNING, code, 1, text, fmt::make_format_args(args...));
  }
  template <class... Args>
  void error(Stamp now, std::string_view code, fmt::format_string<Args...> text,
             const Args&... args) {
    send(now, event_t::SEVERITY_ERROR, code, 1, text, fmt::make_format_args(args...));
  }
  /// A change of state: subscribers need its end as well as its beginning.
  template <class... Args>
  void transition(Stamp now, std::int8_t severity, std::string_view code,
                  fmt::format_string<Args...> text, const Args&... args) {
    send(now, severity, code, kMaxTransitions, text, fmt::make_format_args(args...));
  }

 private:
  static constexpr int kMaxTransitions = 10;  // of a code within the interval: a flapping state
  struct Code {
    std::string_view name;
    Stamp window_begin;
    int sent = 0;               // in the window
    std::int64_t repeated = 0;  // not sent since the last message
  };

  void send(Stamp now, std::int8_t severity, std::string_view code, int max_sent,
            fmt::string_view text, fmt::format_args args);

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
  std::int64_t start_utime_;  // wall clock
};

}  // namespace rcs

#include "rcs/node/report.h"

#include <algorithm>
#include <cctype>
#include <exception>
#include <iterator>

#include "rcs/base/printable.h"
#include "rcs/node/bus/message_size.h"
#include "rcs/node/time_text.h"
#include "rcs/node/timeline/live_timeline.h"

namespace rcs {

std::string channel_of(std::string_view node, std::string_view suffix) {
  std::string channel(node);
  for (char& c : channel) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return channel.append("_").append(suffix);
}

namespace {

std::int8_t to_message(event::Severity severity) {
  if (severity == event::Severity::kError) return event_t::SEVERITY_ERROR;
  return severity == event::Severity::kWarning ? event_t::SEVERITY_WARNING : event_t::SEVERITY_INFO;
}

}  // namespace

Report::Report(Bus* bus, std::string_view node, Duration interval)
    : outbox_(bus, channel_of(node, "EVENT")), interval_(interval) {
  codes_.reserve(32);
  outbox_.reserve(512);
  message_.text.reserve(256);
  message_.node = node;
}

void Report::send(Stamp now, const event::Info& event, event::Severity severity,
                  fmt::string_view text, fmt::format_args args) {
  const std::string_view code = event.code;
  const int max_sent = event.limit == event::Limit::kTen ? 10 : 1;  // a state may flap
  const auto known =
      std::find_if(codes_.begin(), codes_.end(), [&](const Code& c) { return c.name == code; });
  Code& entry = known != codes_.end() ? *known : codes_.emplace_back(Code{code, now});
  if (now - entry.window_begin >= interval_) {
    entry.window_begin = now;
    entry.sent = 0;
  }
  if (entry.sent >= max_sent) {
    ++entry.repeated;
    return;
  }
  message_.utime = to_utime(now);
  message_.severity = to_message(severity);
  message_.code = code;
  message_.text.clear();
  fmt::vformat_to(std::back_inserter(message_.text), text, args);
  message_.repeated = entry.repeated;
  ++entry.sent;
  entry.repeated = 0;
  outbox_.publish(&message_);
}

EventPrinter::EventPrinter(Bus* bus, std::string_view node) : start_utime_(wall_utime()) {
  bus->subscribe(channel_of(node, "EVENT"), this);
}

void EventPrinter::receive(const std::uint8_t* data, std::size_t size, Stamp) noexcept {
  try {
    if (size > kMaxEncodedBytes<event_t>) return;
    if (event_.decode(data, 0, static_cast<int>(size)) != static_cast<int>(size)) return;
    const char* severity = event_.severity == event_t::SEVERITY_ERROR     ? "error"
                           : event_.severity == event_t::SEVERITY_WARNING ? "warning"
                                                                          : "info";
    const std::int64_t now = wall_utime();
    // Texts of the bus may contain control characters of terminals.
    lines_.print(printable_line(fmt::format(
        "{} {} UTC, {:.1f} s {}: {}: {}{}", event_.node, time_of_day(now),
        seconds(Duration(now - start_utime_)), severity, event_.code, event_.text,
        event_.repeated > 0 ? fmt::format(" (and {} times before)", event_.repeated) : "")));
  } catch (const std::exception&) {
    return;  // no memory for the text; the event is on the bus anyway
  }
}

}  // namespace rcs

#include "tools/recorder/audit_trail.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/message_names.h"
#include "rcs/node/bus/message_size.h"
#include "rcs/node/bus/publisher.h"
#include "rcs/node/time_text.h"

namespace rcs::recorder {
namespace {

using Json = nlohmann::ordered_json;

/// Commands that are remembered: a flood of ever new ones must not use up the memory.
constexpr std::size_t kMaxNewest = 1000;
constexpr std::size_t kMaxStopIds = 16;

constexpr std::string_view kAuditedEvents[] = {"command.", "operator.",  "stop.",
                                               "dds.",     "node.",      "record.",
                                               "bus.",     "publisher.", "recorder."};

constexpr std::string_view kRefusal = "command.rejected";

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

Json line(Stamp wall, std::string_view type, std::string_view channel) {
  const std::int64_t utime = to_utime(wall);
  return {{"time", fmt::format("{}T{}Z", utc_date(utime), time_of_day(utime))},
          {"log_utime", utime},
          {"type", type},
          {"channel", channel}};
}

/// Names and texts come from the bus: invalid UTF-8 is replaced, control characters are escaped.
std::string text(const Json& json) {
  return json.dump(-1, ' ', true, Json::error_handler_t::replace);
}

template <class T>
Json with_publisher(Json json, const T& message) {
  json["run_id"] = id_text(message.run_id);
  json["publisher_id"] = id_text(message.publisher_id);
  return json;
}

std::string name_of(const std::string& text) { return text.substr(0, AuditTrail::kMaxName); }
std::string cut(const std::string& text) { return text.substr(0, AuditTrail::kMaxText); }

std::string_view kind_name(int kind) {
  constexpr std::string_view kNames[] = {"HALT",    "GOTO",   "ABORT", "EMERGENCY_STOP",
                                         "RELEASE", "FOLLOW", "RETURN"};
  return constant_name<command_t::KIND_RETURN>(kNames, kind);
}

std::string_view severity_name(int severity) {
  constexpr std::string_view kNames[] = {"INFO", "WARNING", "ERROR"};
  return constant_name<event_t::SEVERITY_ERROR>(kNames, severity);
}

}  // namespace

std::string AuditTrail::begin_line(Stamp wall, std::string_view bus) {
  Json json = line(wall, "recorder_started", "");
  json["bus"] = bus;
  return text(json);
}

std::string AuditTrail::end_line(Stamp wall) { return text(line(wall, "recorder_ended", "")); }

std::vector<std::string> AuditTrail::on_message(Stamp wall, std::string_view channel,
                                                const std::uint8_t* data, std::size_t size) {
  lines_.clear();
  if (!unconfirmed_.empty()) report_unconfirmed(wall);
  report_unlisted(wall);
  if (channel == channel::kBgCommand || channel == channel::kBgStop ||
      channel == channel::kMissionCommand) {
    if (read(data, size, &command_)) on_command(wall, channel);
  } else if (channel == channel::kWmPathQuery) {
    if (read(data, size, &query_)) on_query(wall);
  } else if (channel == channel::kBgStatus || channel == channel::kMissionStatus) {
    if (read(data, size, &status_)) on_status(wall, channel);
  } else if (ends_with(channel, "_EVENT")) {
    if (read(data, size, &event_)) on_event(wall, channel);
  }
  return lines_;
}

/// Nodes reject larger messages of the type, too.
template <class T>
bool AuditTrail::read(const std::uint8_t* data, std::size_t size, T* message) {
  if (size <= kMaxEncodedBytes<T>) {
    return message->decode(data, 0, static_cast<int>(size)) == static_cast<int>(size);
  }
  ++too_large_;
  return false;
}

void AuditTrail::report_unlisted(Stamp wall) {
  const std::pair<IssuerLimit*, std::string_view> limits[] = {
      {&commands_limit_, "commands or queries"},
      {&stops_limit_, "stops or releases"},
      {&events_limit_, "events"}};
  const bool suppresses = std::any_of(std::begin(limits), std::end(limits),
                                      [](const auto& l) { return l.first->suppresses(); });
  if (!suppresses && too_large_ == 0) return;
  // The clock may have been set back.
  if (wall < unlisted_reported_) unlisted_reported_ = wall;
  if (unlisted_reported_ != Stamp::min() && wall - unlisted_reported_ < kReportEvery) return;
  unlisted_reported_ = wall;
  const auto add = [&](const std::string& issuer, std::int64_t messages, std::string why) {
    Json json = line(wall, "not_listed", "");
    json["issuer"] = issuer;
    json["messages"] = messages;
    json["text"] = std::move(why);
    lines_.push_back(text(json));
  };
  for (const auto& [limit, what] : limits) {
    for (const IssuerLimit::Suppressed& s : limit->take_suppressed()) {
      add(s.issuer, s.lines,
          fmt::format("{} {} of {} not listed: more than {:.0f} per second", s.lines, what,
                      s.of_others ? "further issuers" : s.issuer,
                      1.0 / seconds(IssuerLimit::kInterval)));
    }
  }
  if (too_large_ == 0) return;
  add("", too_large_,
      fmt::format("{} messages not listed: larger than {} kB", too_large_,
                  kMaxEncodedBytes<command_t> / 1024));
  too_large_ = 0;
}

void AuditTrail::report_unconfirmed(Stamp wall) {
  for (auto it = unconfirmed_.begin(); it != unconfirmed_.end();) {
    const auto& [to, pending] = *it;
    const auto& [status_channel, issuer] = to;
    const bool of_bg = status_channel == channel::kBgStatus;
    if (wall - pending.since < kEchoWithin) {
      ++it;
      continue;
    }
    Json json = line(wall, "refusal", status_channel);
    json["issuer"] = issuer;
    json["serial"] = pending.serial;
    json["commands"] = pending.commands;
    json["text"] =
        fmt::format("{} did not echo the command: refused, lost, or replaced by another issuer",
                    of_bg ? "BG" : "the mission");
    lines_.push_back(text(json));
    it = unconfirmed_.erase(it);
  }
}

bool AuditTrail::is_new(const std::string& key, const Identity& identity) {
  const auto known = newest_.find(key);
  if (known == newest_.end()) {
    if (newest_.size() >= kMaxNewest) newest_.clear();
    newest_.emplace(key, identity);
    return true;
  }
  Identity& last = known->second;
  if (last.serial == identity.serial && last.utime == identity.utime &&
      last.publisher_id == identity.publisher_id) {
    return false;
  }
  last = identity;
  return true;
}

void AuditTrail::on_command(Stamp wall, std::string_view channel) {
  const command_t& m = command_;
  const std::string issuer = name_of(m.issuer);
  const bool stops = m.kind == command_t::KIND_EMERGENCY_STOP || m.kind == command_t::KIND_RELEASE;
  IssuerLimit& limit = stops ? stops_limit_ : commands_limit_;
  const bool own_limit = limit.note(issuer, wall);
  if (own_limit) {
    const std::string key = fmt::format("{}:{}:{}", channel, m.kind, issuer);
    if (!is_new(key, {m.serial, m.utime, m.publisher_id})) return;
  }
  if (own_limit) {
    const std::string_view answer =
        channel == channel::kMissionCommand ? channel::kMissionStatus : channel::kBgStatus;
    Unconfirmed& pending = unconfirmed_
                               .emplace(std::pair(std::string(answer), issuer),
                                        Unconfirmed{wall, 0, m.serial, m.serial})
                               .first->second;
    ++pending.commands;
    pending.serial = m.serial;
  }
  if (!limit.admit(issuer, wall)) return;
  Json json = line(wall, "command", channel);
  json["issuer"] = issuer;
  json["kind"] = kind_name(m.kind);
  json["serial"] = m.serial;
  json["task"] = m.task;
  json["waypoints"] = m.n;
  if (m.n_stops > 0) {
    const std::size_t listed = std::min(m.stop_id.size(), kMaxStopIds);
    json["stop_ids"] = std::vector<std::int64_t>(
        m.stop_id.begin(), m.stop_id.begin() + static_cast<std::ptrdiff_t>(listed));
  }
  json["issued_utime"] = m.utime;
  json["valid_until_utime"] = m.valid_until_utime;
  lines_.push_back(text(with_publisher(std::move(json), m)));
}

void AuditTrail::on_query(Stamp wall) {
  const path_query_t& m = query_;
  const std::string issuer = name_of(m.issuer);
  if (commands_limit_.note(issuer, wall)) {
    const std::string key = fmt::format("{}::{}", channel::kWmPathQuery, issuer);
    if (!is_new(key, {m.serial, 0, m.publisher_id})) return;
  }
  if (!commands_limit_.admit(issuer, wall)) return;
  Json json = line(wall, "query", channel::kWmPathQuery);
  json["issuer"] = issuer;
  json["serial"] = m.serial;
  json["points"] = m.n;
  lines_.push_back(text(with_publisher(std::move(json), m)));
}

void AuditTrail::on_event(Stamp wall, std::string_view channel) {
  const event_t& m = event_;
  bool audited = false;
  for (const std::string_view prefix : kAuditedEvents) {
    audited = audited || m.code.compare(0, prefix.size(), prefix) == 0;
  }
  if (!audited) return;
  // The issuer of an event is its node. Nodes limit their own; a forger does not.
  (void)events_limit_.note(channel, wall);
  if (!events_limit_.admit(channel, wall)) return;
  Json json = line(wall, m.code == kRefusal ? "refusal" : "event", channel);
  json["severity"] = severity_name(m.severity);
  json["code"] = name_of(m.code);
  json["text"] = cut(m.text);
  json["repeated"] = m.repeated;
  lines_.push_back(text(with_publisher(std::move(json), m)));
}

void AuditTrail::on_status(Stamp wall, std::string_view channel) {
  const status_t& m = status_;
  const std::string issuer = name_of(m.issuer);
  const std::string state = name_of(m.state);
  // An echo of an older serial is that of a command which is still in force.
  const auto pending = unconfirmed_.find({std::string(channel), issuer});
  if (pending != unconfirmed_.end() && m.echo_serial >= pending->second.first_serial &&
      m.echo_serial <= pending->second.serial) {
    unconfirmed_.erase(pending);
  }
  std::string key =
      fmt::format("{}:{}:{}:{}:{}", issuer, m.echo_serial, m.status, state, m.emergency_stop);
  std::string& before = status_keys_[channel == channel::kBgStatus ? 0 : 1];
  if (key == before) return;
  before = std::move(key);
  Json json = line(wall, "status", channel);
  json["issuer"] = issuer;
  json["serial"] = m.echo_serial;
  json["status"] = status_name(m.status);
  json["state"] = state;
  json["reason"] = cut(m.reason);
  json["emergency_stop"] = emergency_stop_name(m.emergency_stop);
  lines_.push_back(text(with_publisher(std::move(json), m)));
}

}  // namespace rcs::recorder

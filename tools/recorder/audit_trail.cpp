#include "tools/recorder/audit_trail.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/message_names.h"
#include "rcs/node/time_text.h"

namespace rcs::recorder {
namespace {

using Json = nlohmann::ordered_json;

/// Issuers whose newest command is remembered: a flood of ever new names must not use up the
/// memory.
constexpr std::size_t kMaxIssuers = 1000;

constexpr std::string_view kAuditedEvents[] = {"command.", "operator.",  "stop.",
                                               "dds.",     "node.",      "record.",
                                               "bus.",     "publisher.", "recorder."};

constexpr std::string_view kRefusal = "command.rejected";

/// The decoders take an int.
constexpr std::size_t kMaxMessageBytes = std::size_t{16} << 20;

template <class T>
bool decode(const std::uint8_t* data, std::size_t size, T* message) {
  return message->decode(data, 0, static_cast<int>(size)) == static_cast<int>(size);
}

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
  json["run_id"] = message.run_id;
  json["publisher_id"] = message.publisher_id;
  return json;
}

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
  if (size > kMaxMessageBytes) return lines_;
  if (channel == channel::kBgCommand || channel == channel::kBgStop ||
      channel == channel::kMissionCommand) {
    if (decode(data, size, &command_)) on_command(wall, channel);
  } else if (channel == channel::kWmPathQuery) {
    if (decode(data, size, &query_)) on_query(wall);
  } else if (channel == channel::kBgStatus || channel == channel::kMissionStatus) {
    if (decode(data, size, &status_)) on_status(wall, channel);
  } else if (ends_with(channel, "_EVENT")) {
    if (decode(data, size, &event_)) on_event(wall, channel);
  }
  return lines_;
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
    if (newest_.size() >= kMaxIssuers) newest_.clear();
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
  const std::string key = fmt::format("{}:{}:{}", channel, m.kind, m.issuer);
  if (!is_new(key, {m.serial, m.utime, m.publisher_id})) return;
  if (unconfirmed_.size() < kMaxIssuers) {
    const std::string_view answer =
        channel == channel::kMissionCommand ? channel::kMissionStatus : channel::kBgStatus;
    Unconfirmed& pending = unconfirmed_
                               .emplace(std::pair(std::string(answer), m.issuer),
                                        Unconfirmed{wall, 0, m.serial, m.serial})
                               .first->second;
    ++pending.commands;
    pending.serial = m.serial;
  }
  Json json = line(wall, "command", channel);
  json["issuer"] = m.issuer;
  json["kind"] = kind_name(m.kind);
  json["serial"] = m.serial;
  json["task"] = m.task;
  json["waypoints"] = m.n;
  if (m.n_stops > 0) json["stop_ids"] = m.stop_id;
  json["issued_utime"] = m.utime;
  json["valid_until_utime"] = m.valid_until_utime;
  lines_.push_back(text(with_publisher(std::move(json), m)));
}

void AuditTrail::on_query(Stamp wall) {
  const path_query_t& m = query_;
  const std::string key = fmt::format("{}::{}", channel::kWmPathQuery, m.issuer);
  if (!is_new(key, {m.serial, 0, m.publisher_id})) return;
  Json json = line(wall, "query", channel::kWmPathQuery);
  json["issuer"] = m.issuer;
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
  Json json = line(wall, m.code == kRefusal ? "refusal" : "event", channel);
  json["severity"] = severity_name(m.severity);
  json["code"] = m.code;
  json["text"] = m.text;
  json["repeated"] = m.repeated;
  lines_.push_back(text(with_publisher(std::move(json), m)));
}

void AuditTrail::on_status(Stamp wall, std::string_view channel) {
  const status_t& m = status_;
  // An echo of an older serial is that of a command which is still in force.
  const auto pending = unconfirmed_.find({std::string(channel), m.issuer});
  if (pending != unconfirmed_.end() && m.echo_serial >= pending->second.first_serial &&
      m.echo_serial <= pending->second.serial) {
    unconfirmed_.erase(pending);
  }
  std::string key =
      fmt::format("{}:{}:{}:{}:{}", m.issuer, m.echo_serial, m.status, m.state, m.emergency_stop);
  std::string& before = status_keys_[channel == channel::kBgStatus ? 0 : 1];
  if (key == before) return;
  before = std::move(key);
  Json json = line(wall, "status", channel);
  json["issuer"] = m.issuer;
  json["serial"] = m.echo_serial;
  json["status"] = status_name(m.status);
  json["state"] = m.state;
  json["reason"] = m.reason;
  json["emergency_stop"] = emergency_stop_name(m.emergency_stop);
  lines_.push_back(text(with_publisher(std::move(json), m)));
}

}  // namespace rcs::recorder

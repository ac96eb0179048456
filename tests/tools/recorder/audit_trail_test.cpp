// What the audit log contains.

#include "tools/recorder/audit_trail.h"

#include <gmock/gmock.h>
#include <malloc.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "lcmtypes/channels.h"

namespace rcs::recorder {
namespace {

using nlohmann::json;

constexpr Stamp kWall = from_utime(1'395'837'296'789'000);  // 2014-03-26 12:34:56.789 UTC

template <class T>
std::vector<json> lines(AuditTrail* trail, const char* channel, const T& m, Duration after = {}) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(m.getEncodedSize()));
  (void)m.encode(bytes.data(), 0, m.getEncodedSize());
  std::vector<json> parsed;
  for (const std::string& line :
       trail->on_message(kWall + after, channel, bytes.data(), bytes.size())) {
    EXPECT_EQ(line.find('\n'), std::string::npos);
    parsed.push_back(json::parse(line));
  }
  return parsed;
}

command_t command(const char* issuer, std::int64_t serial,
                  std::int8_t kind = command_t::KIND_GOTO) {
  command_t m{};
  m.issuer = issuer;
  m.serial = serial;
  m.kind = kind;
  m.utime = serial;
  m.publisher_id = 77;
  return m;
}

status_t status(const char* issuer, std::int64_t serial, const char* state) {
  status_t m{};
  m.node = "bg";
  m.issuer = issuer;
  m.echo_serial = serial;
  m.status = status_t::STATUS_EXEC;
  m.state = state;
  return m;
}

event_t event_of(const char* code, const char* text) {
  event_t m{};
  m.node = "gateway";
  m.severity = event_t::SEVERITY_WARNING;
  m.code = code;
  m.text = text;
  return m;
}

TEST(AuditTrail, ACommandIsOneLineHoweverOftenItIsSent) {
  AuditTrail trail;
  const std::vector<json> first = lines(&trail, channel::kBgCommand, command("alice", 5));
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0]["time"], "2014-03-26T12:34:56.789Z");
  EXPECT_EQ(first[0]["type"], "command");
  EXPECT_EQ(first[0]["issuer"], "alice");
  EXPECT_EQ(first[0]["kind"], "GOTO");
  EXPECT_EQ(first[0]["serial"], 5);
  EXPECT_EQ(first[0]["publisher_id"], "4d") << "hexadecimal, as in the texts of events";
  EXPECT_EQ(first[0]["run_id"], "0");
  EXPECT_TRUE(lines(&trail, channel::kBgCommand, command("alice", 5)).empty());
  EXPECT_EQ(lines(&trail, channel::kBgCommand, command("alice", 6)).size(), 1U);
  EXPECT_EQ(lines(&trail, channel::kBgCommand, command("bob", 6)).size(), 1U);
  const auto stop =
      lines(&trail, channel::kBgCommand, command("bob", 6, command_t::KIND_EMERGENCY_STOP));
  ASSERT_EQ(stop.size(), 1U);
  EXPECT_EQ(stop[0]["kind"], "EMERGENCY_STOP");
  command_t named = command("bob", 7, command_t::KIND_EMERGENCY_STOP);
  named.n_stops = 1;
  named.stop_id = {42};
  const auto on_its_channel = lines(&trail, channel::kBgStop, named);
  ASSERT_EQ(on_its_channel.size(), 1U);
  EXPECT_EQ(on_its_channel[0]["channel"], "BG_STOP");
  EXPECT_EQ(on_its_channel[0]["stop_ids"], json::array({42}));
  EXPECT_TRUE(lines(&trail, channel::kBgStop, named).empty());
  // Stops and other commands that alternate are still repetitions.
  EXPECT_TRUE(lines(&trail, channel::kBgCommand, command("bob", 6)).empty());
}

TEST(AuditTrail, EventsOfOperatorsCommandsAndStopsAndRefusals) {
  AuditTrail trail;
  const auto refusal = lines(&trail, channel::kGatewayEvent,
                             event_of("command.rejected", "WaypointCommand 7 of mallory: stale"));
  ASSERT_EQ(refusal.size(), 1U);
  EXPECT_EQ(refusal[0]["type"], "refusal");
  EXPECT_EQ(refusal[0]["text"], "WaypointCommand 7 of mallory: stale");
  for (const char* code : {"command.goto", "operator.silent", "stop.engaged", "dds.unsecured"}) {
    const auto event = lines(&trail, channel::kGatewayEvent, event_of(code, "x"));
    ASSERT_EQ(event.size(), 1U) << code;
    EXPECT_EQ(event[0]["type"], "event");
    EXPECT_EQ(event[0]["severity"], "WARNING");
  }
  EXPECT_TRUE(lines(&trail, channel::kWmEvent, event_of("fde", "x")).empty());
  EXPECT_TRUE(lines(&trail, channel::kSpEvent, event_of("input.rejected", "x")).empty());
}

TEST(AuditTrail, AStatusIsALineWhenItChanges) {
  AuditTrail trail;
  EXPECT_EQ(lines(&trail, channel::kBgStatus, status("alice", 5, "DRIVING")).size(), 1U);
  EXPECT_TRUE(lines(&trail, channel::kBgStatus, status("alice", 5, "DRIVING")).empty());
  const auto stopped = lines(&trail, channel::kBgStatus, status("alice", 5, "EMERGENCY_STOP"));
  ASSERT_EQ(stopped.size(), 1U);
  EXPECT_EQ(stopped[0]["state"], "EMERGENCY_STOP");
  EXPECT_EQ(stopped[0]["status"], "EXEC");
}

TEST(AuditTrail, ACommandThatBgDoesNotEchoIsARefusal) {
  AuditTrail trail;
  (void)lines(&trail, channel::kBgCommand, command("alice", 10));
  (void)lines(&trail, channel::kBgStatus, status("alice", 10, "DRIVING"), from_seconds(0.1));
  // An older serial: BG goes on with the command in force.
  (void)lines(&trail, channel::kBgCommand, command("alice", 4), from_seconds(1.0));
  EXPECT_TRUE(
      lines(&trail, channel::kBgStatus, status("alice", 10, "DRIVING"), from_seconds(2.9)).empty());
  const auto late =
      lines(&trail, channel::kBgStatus, status("alice", 10, "DRIVING"), from_seconds(3.0));
  ASSERT_EQ(late.size(), 1U);
  EXPECT_EQ(late[0]["type"], "refusal");
  EXPECT_EQ(late[0]["issuer"], "alice");
  EXPECT_EQ(late[0]["serial"], 4);
  EXPECT_TRUE(
      lines(&trail, channel::kBgStatus, status("alice", 10, "DRIVING"), from_seconds(9.0)).empty());
}

TEST(AuditTrail, CommandsThatFollowQuicklyAreConfirmedByAnyOfTheirEchoes) {
  AuditTrail trail;
  for (int k = 1; k <= 300; ++k) {
    const Duration at = from_milliseconds(20.0 * k);
    EXPECT_EQ(lines(&trail, channel::kBgCommand, command("planner", k), at).size(), 1U);
    if (k % 3 != 0) continue;
    for (const json& line :
         lines(&trail, channel::kBgStatus, status("planner", k - 1, "DRIVING"), at)) {
      EXPECT_EQ(line["type"], "status");
    }
  }
}

TEST(AuditTrail, NamesFromTheBusCannotChangeTheFormat) {
  AuditTrail trail;
  const auto hostile =
      lines(&trail, channel::kBgCommand, command("a\n{\"type\": \"x\"}\033[2J\xff", 1));
  ASSERT_EQ(hostile.size(), 1U);
  EXPECT_EQ(hostile[0]["type"], "command");
  const std::vector<std::uint8_t> garbage(40, 0xEE);
  EXPECT_TRUE(trail.on_message(kWall, channel::kBgCommand, garbage.data(), garbage.size()).empty());
  EXPECT_TRUE(trail.on_message(kWall, "X_EVENT", garbage.data(), garbage.size()).empty());
}

std::size_t heap_bytes() {
  const struct mallinfo2 heap = mallinfo2();
  return heap.uordblks + heap.hblkhd;
}

TEST(AuditTrail, FloodsOfLongNamesTakeNoMemory) {
  AuditTrail trail;
  (void)lines(&trail, channel::kBgCommand, command("alice", 1));
  const std::string padding(60'000, 'x');
  std::vector<std::uint8_t> bytes;
  const auto send = [&](command_t m, int k) {
    bytes.resize(static_cast<std::size_t>(m.getEncodedSize()));
    (void)m.encode(bytes.data(), 0, m.getEncodedSize());
    std::size_t most = 0;
    for (const std::string& line : trail.on_message(kWall + k * from_milliseconds(1.0),
                                                    channel::kBgStop, bytes.data(), bytes.size())) {
      most = std::max(most, line.size());
    }
    return most;
  };
  const std::size_t before = heap_bytes();
  std::size_t longest = 0;
  for (int k = 0; k < 3000; ++k) {
    // Half of them stops, which have a limit of their own.
    const std::int8_t kind = k % 2 == 0 ? command_t::KIND_EMERGENCY_STOP : command_t::KIND_GOTO;
    const std::string issuer = std::to_string(k) + padding;
    longest = std::max(longest, send(command(issuer.c_str(), k, kind), k));
  }
  EXPECT_LT(heap_bytes(), before + (std::size_t{2} << 20));
  EXPECT_GT(longest, 200U);
  EXPECT_LT(longest, 600U);
}

TEST(AuditTrail, MessagesThatNoNodeAcceptsAreCounted) {
  AuditTrail trail;
  const std::string issuer(std::size_t{1} << 20, 'x');
  const std::size_t before = heap_bytes();
  for (int k = 0; k < 20; ++k) {
    const auto listed = lines(&trail, channel::kBgCommand, command(issuer.c_str(), k));
    EXPECT_EQ(listed.size(), k == 1 ? 1U : 0U) << "the first one is reported with the next message";
  }
  EXPECT_LT(heap_bytes(), before + (std::size_t{1} << 18));
  const auto later =
      lines(&trail, channel::kBgStatus, status("", 0, "IDLE"), AuditTrail::kReportEvery);
  ASSERT_EQ(later.size(), 2U);
  EXPECT_EQ(later[0]["type"], "not_listed");
  EXPECT_EQ(later[0]["text"], "19 messages not listed: larger than 64 kB");
}

TEST(AuditTrail, AFloodOfCommandsDisplacesNothing) {
  AuditTrail trail;
  std::size_t bytes = 0;
  std::map<std::string, int> types;
  std::int64_t not_listed = 0;
  const auto send = [&](const char* channel, const auto& m, double at_s) {
    for (const json& line : lines(&trail, channel, m, from_seconds(at_s))) {
      bytes += line.dump().size() + 1;
      ++types[line["type"].get<std::string>()];
      if (line["type"] != "not_listed") continue;
      EXPECT_EQ(line["issuer"], "mallory");
      not_listed += line["messages"].get<std::int64_t>();
    }
  };
  // 20 s of 1000 commands per second; without a limit 7 MB.
  for (int k = 0; k < 20'000; ++k) {
    const double t = 0.001 * k;
    send(channel::kBgCommand, command("mallory", k + 1), t);
    if (k % 1000 != 500) continue;
    const int n = k / 1000;
    send(channel::kBgStop, command("operator", n, command_t::KIND_EMERGENCY_STOP), t);
    send(channel::kBgStop, command("operator", n, command_t::KIND_RELEASE), t);
    // Of the issuer of the flood, too.
    send(channel::kBgCommand, command("mallory", k + 1, command_t::KIND_EMERGENCY_STOP), t);
    send(channel::kBgStatus, status("operator", n, n % 2 == 0 ? "DRIVING" : "EMERGENCY_STOP"), t);
    send(channel::kGatewayEvent, event_of("command.rejected", "not authorized"), t);
    send(channel::kGatewayEvent, event_of("stop.engaged", "by operator"), t);
  }
  send(channel::kBgStatus, status("operator", 0, "IDLE"), 30.0);
  EXPECT_EQ(types["command"] + not_listed, 20'000 + 3 * 20);
  EXPECT_LE(types["command"], IssuerLimit::kBurst + 41 + 3 * 20);
  EXPECT_EQ(types["status"], 21);
  EXPECT_EQ(types["event"], 20);
  EXPECT_GE(types["refusal"], 20 + 9) << "of the gateway, and one per 2 s of what BG did not echo";
  EXPECT_LE(types["not_listed"], 6);
  EXPECT_LT(bytes, 300'000U);
}

TEST(AuditTrail, FloodsOfStopsAndEventsDisplaceNothing) {
  AuditTrail trail;
  std::map<std::string, int> listed;
  std::map<std::string, std::int64_t> not_listed;
  std::size_t bytes = 0;
  const auto send = [&](const char* channel, const auto& m, double at_s) {
    for (const json& line : lines(&trail, channel, m, from_seconds(at_s))) {
      bytes += line.dump().size() + 1;
      if (line["type"] == "not_listed") {
        not_listed[line["issuer"]] += line["messages"].get<std::int64_t>();
      } else if (line["type"] != "refusal") {
        ++listed[line.value("issuer", line["channel"].get<std::string>())];
      }
    }
  };
  // 20 s of 1000 stops and 1000 events per second.
  for (int k = 0; k < 20'000; ++k) {
    const double t = 0.001 * k;
    send(channel::kBgStop, command("mallory", k + 1, command_t::KIND_EMERGENCY_STOP), t);
    send("MALLORY_EVENT", event_of("stop.engaged", "by operator"), t);
    if (k % 1000 != 500) continue;
    const int n = k / 1000;
    send(channel::kBgStop, command("operator", n, command_t::KIND_EMERGENCY_STOP), t);
    send(channel::kBgCommand, command("mallory", k + 1), t);
    send(channel::kGatewayEvent, event_of("stop.engaged", "by operator"), t);
  }
  send(channel::kBgStatus, status("nobody", 0, "IDLE"), 30.0);
  EXPECT_EQ(listed["operator"], 20);
  EXPECT_EQ(listed[channel::kGatewayEvent], 20);
  EXPECT_LE(listed["mallory"], IssuerLimit::kBurst + 41 + 20);
  EXPECT_EQ(listed["mallory"] + not_listed["mallory"], 20'020);
  EXPECT_EQ(listed["MALLORY_EVENT"] + not_listed["MALLORY_EVENT"], 20'000);
  EXPECT_LT(bytes, 300'000U);
}

TEST(AuditTrail, EverNewNamesDisplaceNothing) {
  AuditTrail trail;
  (void)lines(&trail, channel::kBgCommand, command("operator", 1));
  std::size_t n = 0;
  for (int k = 0; k < 20'000; ++k) {
    const Duration at = from_milliseconds(1.0 * k);
    const std::string name = "issuer" + std::to_string(k);
    n += lines(&trail, channel::kBgCommand, command(name.c_str(), 1), at).size();
    if (k % 2000 != 0) continue;
    EXPECT_EQ(lines(&trail, channel::kBgCommand, command("operator", 2 + k), at)[0]["issuer"],
              "operator");
    EXPECT_TRUE(lines(&trail, channel::kBgCommand, command("operator", 2 + k), at).empty());
  }
  EXPECT_LT(n, 500U);
  const auto later = lines(&trail, channel::kBgStatus, status("", 0, "IDLE"), from_seconds(40.0));
  bool counted = false;
  for (const json& line : later) {
    counted = counted || (line["type"] == "not_listed" &&
                          line["text"].get<std::string>().find(
                              "commands or queries of further issuers not listed: more than 2 per "
                              "second") != std::string::npos);
  }
  EXPECT_TRUE(counted);
}

TEST(AuditTrail, ContainsTasksOfTheMissionAndSecondPublishers) {
  AuditTrail trail;
  const auto of_bg = lines(&trail, channel::kBgCommand, command("operator", 5));
  ASSERT_EQ(of_bg.size(), 1U);
  const auto task =
      lines(&trail, channel::kMissionCommand, command("operator", 6, command_t::KIND_RETURN));
  ASSERT_EQ(task.size(), 1U);
  EXPECT_EQ(task[0]["kind"], "RETURN");
  EXPECT_EQ(task[0]["channel"], channel::kMissionCommand);
  EXPECT_EQ(lines(&trail, channel::kMissionStatus, status("operator", 6, "DRIVING")).size(), 1U);
  EXPECT_EQ(lines(&trail, channel::kMissionStatus, status("operator", 6, "DRIVING")).size(), 0U);
  // The mission has echoed its task; BG has not echoed its command.
  const auto later = lines(&trail, channel::kBgStatus, status("", 0, "IDLE"), from_seconds(3.0));
  ASSERT_EQ(later.size(), 2U);
  EXPECT_EQ(later[0]["type"], "refusal");
  EXPECT_EQ(later[0]["serial"], 5);
  EXPECT_EQ(later[0]["channel"], channel::kBgStatus);
  const auto second = lines(&trail, "BG_EVENT", event_of("publisher.rejected", "BG_DRIVE: ..."));
  ASSERT_EQ(second.size(), 1U);
  EXPECT_EQ(second[0]["code"], "publisher.rejected");
}

}  // namespace
}  // namespace rcs::recorder

// What the audit log contains.

#include "tools/recorder/audit_trail.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

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
  EXPECT_EQ(first[0]["publisher_id"], 77);
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
  // Ever new names: the memory is bounded, and no command is left out.
  for (int k = 0; k < 5000; ++k) {
    const std::string name = "issuer" + std::to_string(k);
    EXPECT_EQ(lines(&trail, channel::kBgCommand, command(name.c_str(), 1)).size(), 1U);
  }
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

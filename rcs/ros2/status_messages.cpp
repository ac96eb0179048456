#include "rcs/ros2/status_messages.h"

namespace rcs::ros2 {
namespace {

enum Level : std::uint8_t { kOk = 0, kWarning = 1 };

msg::KeyValue value(const char* key, std::int64_t number) { return {key, std::to_string(number)}; }

msg::DiagnosticArray array_of(std::int64_t utime, const ClockOffsets& clocks,
                              msg::DiagnosticStatus status) {
  msg::DiagnosticArray out;
  out.header.stamp = to_time(shifted(utime, clocks.node_us));
  out.status.push_back(std::move(status));
  return out;
}

std::string degraded(int level) {
  return level > 0 ? "degrade level " + std::to_string(level) : std::string();
}

void append(const std::string& reason, std::string* message) {
  if (!reason.empty()) *message += (message->empty() ? "" : "; ") + reason;
}

}  // namespace

msg::Log to_log(const event_t& m, const ClockOffsets& clocks) {
  enum : std::uint8_t { kLogInfo = 20, kLogWarning = 30, kLogError = 40 };
  msg::Log out;
  out.stamp = to_time(shifted(m.utime, clocks.node_us));
  out.level = m.severity == event_t::SEVERITY_INFO      ? kLogInfo
              : m.severity == event_t::SEVERITY_WARNING ? kLogWarning
                                                        : kLogError;
  out.name = m.node;
  out.msg = m.code + ": " + m.text;
  return out;
}

msg::DiagnosticArray to_diagnostics(const cycle_t& m, const ClockOffsets& clocks) {
  msg::DiagnosticStatus status;
  status.name = m.node + ": cycle";
  if (m.slack_us < 0)
    append("overrun: slack " + std::to_string(m.slack_us) + " us", &status.message);
  append(degraded(m.degrade_level), &status.message);
  status.level = static_cast<msg::Byte>(status.message.empty() ? kOk : kWarning);
  status.hardware_id = m.node;
  status.values = {value("late_us", m.late_us),
                   value("used_wall_us", m.used_wall_us),
                   value("used_cpu_us", m.used_cpu_us),
                   value("slack_us", m.slack_us),
                   value("missed", m.missed),
                   value("overruns", m.overruns),
                   value("degrade_level", m.degrade_level)};
  for (const stage_t& stage : m.stage) {
    status.values.push_back(value(("stage " + stage.name + " [us]").c_str(), stage.wall_us));
  }
  return array_of(m.utime, clocks, std::move(status));
}

msg::DiagnosticArray to_diagnostics(const process_t& m, const ClockOffsets& clocks) {
  msg::DiagnosticStatus status;
  status.name = m.node + ": process";
  append(degraded(m.degrade_level), &status.message);
  append(m.note, &status.message);
  status.level = static_cast<msg::Byte>(status.message.empty() ? kOk : kWarning);
  status.hardware_id = m.node;
  status.values = {value("pid", m.pid),
                   value("cpu_us", m.cpu_us),
                   value("rss_kb", m.rss_kb),
                   value("heap_kb", m.heap_kb),
                   value("descriptors", m.descriptors),
                   value("cycles", m.cycles),
                   value("missed", m.missed),
                   value("overruns", m.overruns),
                   value("realtime_priority", m.realtime_priority),
                   value("memory_locked", m.memory_locked),
                   value("degrade_level", m.degrade_level)};
  return array_of(m.utime, clocks, std::move(status));
}

}  // namespace rcs::ros2

#include "tools/rcs/vehicle/top_screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "lcmtypes/channels.h"
#include "lcmtypes/message_names.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "rcs/base/linear.h"
#include "rcs/node/bus/publisher.h"
#include "rcs/node/time_text.h"

namespace rcs::cli {
namespace {

using Style = TopLine::Style;

std::string number(const std::optional<double>& v) { return v ? fmt::format("{:.1f}", *v) : "-"; }

/// "0.02 s", "75 s", "2:05:07"
std::string span(Duration d) {
  const double s = seconds(d);
  if (s < 10.0) return fmt::format("{:.2f} s", s);
  if (s < 120.0) return fmt::format("{:.0f} s", s);
  const auto whole = static_cast<std::int64_t>(s);
  return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string span(const std::optional<Duration>& d) { return d ? span(*d) : "never"; }

const char* severity_name(int severity) {
  return severity == event_t::SEVERITY_ERROR     ? "error"
         : severity == event_t::SEVERITY_WARNING ? "warning"
                                                 : "info";
}

Style style_of(int severity) {
  return severity == event_t::SEVERITY_ERROR     ? Style::kAlarm
         : severity == event_t::SEVERITY_WARNING ? Style::kWarning
                                                 : Style::kPlain;
}

std::string state_of(const evaluation::TopView::Node& n) {
  if (n.alive) return "alive";
  return n.received ? fmt::format("SILENT {}", span(*n.received)) : "no process_t";
}

/// Of SCHED_FIFO; "-": ordinary scheduling.
std::string scheduling_of(const evaluation::TopView::Node& n) {
  const std::string text = n.realtime_priority > 0 ? fmt::format("{}", n.realtime_priority) : "-";
  return n.memory_locked ? text + "+l" : text;
}

Style style_of(const evaluation::TopView::Node& n) {
  if (!n.alive) return Style::kAlarm;
  const bool late = n.min_slack && *n.min_slack < Duration::zero();
  return late || n.degrade_level > 0 ? Style::kWarning : Style::kPlain;
}

void append_nodes(const evaluation::TopView& view, std::vector<TopLine>* lines) {
  // 79 columns; a long cell moves those at its right.
  constexpr const char* kRow =
      "{:<7} {:<6} {:>8} {:>5} {:>6} {:>6} {:>6} {:>4} {:>4} {:>3} {:>4} "
      "{:>5} {:>4}";
  lines->push_back({fmt::format(fmt::runtime(kRow), "node", "state", "up", "Hz", "p50", "max",
                                "slack", "over", "miss", "lvl", "cpu", "MB", "rt"),
                    Style::kHead});
  const auto ms = [](const std::optional<Duration>& d) {
    return d ? fmt::format("{:.1f}", milliseconds(*d)) : "-";
  };
  for (const evaluation::TopView::Node& n : view.nodes) {
    lines->push_back(
        {fmt::format(fmt::runtime(kRow), n.name, state_of(n), n.received ? span(n.up) : "-",
                     number(n.account_hz), ms(n.used_p50), ms(n.used_max), ms(n.min_slack),
                     n.overruns, n.missed, static_cast<int>(n.degrade_level),
                     n.cpu_percent ? fmt::format("{:.0f}", *n.cpu_percent) : "-",
                     fmt::format("{:.0f}", static_cast<double>(n.rss_kb) / 1024.0),
                     scheduling_of(n)),
         style_of(n)});
  }
  for (const evaluation::TopView::Node& n : view.nodes) {
    if (!n.note.empty()) {
      lines->push_back({fmt::format("{}: {}", n.name, n.note), Style::kWarning});
    }
  }
}

/// One input in half of a line.
TopLine input_line(const std::string& node, const evaluation::TopView::Input& in) {
  std::string text = fmt::format("{:<3} {:<15} {:>5} Hz {:>6}", node, in.channel,
                                 number(in.rate_hz), in.age ? span(*in.age) : std::string("never"));
  const auto add = [&text](const char* what, std::int64_t n) {
    if (n > 0) text += fmt::format(" {} {}", what, n);
  };
  add("drop", in.dropped);
  add("gap", in.gaps);
  add("malf", in.malformed);
  add("rej", in.rejected);
  const bool no_data = !in.age && channel::is_sensor(in.channel);
  return {text, in.malformed > 0 || in.rejected > 0 || no_data ? Style::kWarning : Style::kPlain};
}

/// Two inputs a line where both are ordinary and fit.
void append_inputs(const evaluation::TopView& view, std::vector<TopLine>* lines) {
  constexpr std::size_t kHalf = 40;
  std::vector<TopLine> inputs;
  for (const evaluation::TopView::Node& n : view.nodes) {
    for (const evaluation::TopView::Input& in : n.inputs) inputs.push_back(input_line(n.name, in));
  }
  if (inputs.empty()) return;
  lines->push_back({"inputs: rate, age of the newest message", Style::kHead});
  for (std::size_t k = 0; k < inputs.size(); ++k) {
    const bool two = k + 1 < inputs.size() && inputs[k].style == inputs[k + 1].style &&
                     inputs[k].text.size() < kHalf && inputs[k + 1].text.size() < kHalf;
    if (!two) {
      lines->push_back(inputs[k]);
      continue;
    }
    lines->push_back(
        {fmt::format("{:<{}}{}", inputs[k].text, kHalf, inputs[k + 1].text), inputs[k].style});
    ++k;
  }
}

/// Two a line.
void append_processes(const evaluation::TopView& view, std::vector<TopLine>* lines) {
  if (view.processes.empty()) return;
  lines->push_back({"processes: process id, publisher id", Style::kHead});
  for (std::size_t k = 0; k < view.processes.size(); ++k) {
    const evaluation::TopView::Process& p = view.processes[k];
    const std::string cell =
        fmt::format("{:<7} {:>7}  {}", p.node, p.pid, id_text(p.publisher.publisher_id));
    if (k % 2 == 0) {
      lines->push_back({cell});
    } else {
      lines->back().text = fmt::format("{:<40}{}", lines->back().text, cell);
    }
  }
}

void append_rejected(const evaluation::TopView& view, std::vector<TopLine>* lines) {
  for (const evaluation::TopView::Rejected& r : view.rejected) {
    const std::string process =
        r.process ? fmt::format("process {} ({})", r.process->pid, r.process->node)
                  : std::string("no process message");
    lines->push_back({fmt::format("{} rejects {} of publisher {}: {}", r.by, r.channel,
                                  id_text(r.publisher.publisher_id), process),
                      Style::kAlarm});
  }
}

void append_nav(const evaluation::TopView& view, std::vector<TopLine>* lines) {
  const evaluation::TopView::Nav& nav = *view.nav;
  const bool silent = nav.received > evaluation::TopModel::kSilent;
  lines->push_back(
      {fmt::format("wm {}{}{}{}, {} resets, map epoch {}", nav.mode,
                   nav.pose_valid ? "" : ", POSE INVALID",
                   nav.world_valid ? "" : ", no world pose yet",
                   silent ? fmt::format(", SILENT {}", span(nav.received)) : "", nav.world_resets,
                   nav.map_epoch),
       silent || !nav.pose_valid || nav.mode == "LOST" ? Style::kAlarm : Style::kHead});
  lines->push_back({fmt::format(
      "  {}heading {:.1f} deg, {:.1f} m/s",
      nav.world_valid ? fmt::format("lat {:.6f} lon {:.6f} deg, ", nav.lat_deg, nav.lon_deg) : "",
      nav.heading_deg, nav.speed_mps)});
  lines->push_back({fmt::format("  E {:.1f} N {:.1f} U {:.1f} m", nav.p_world_m[0],
                                nav.p_world_m[1], nav.p_world_m[2])});
  lines->push_back(
      {fmt::format("  sigma {:.2f} m forward, {:.2f} m left, {:.2f} m up, {:.2f} deg yaw",
                   nav.sigma_m[0], nav.sigma_m[1], nav.sigma_m[2], degrees(nav.sigma_yaw_rad))});
  const std::string fix = view.fix ? fmt::format("{}, {} satellites, {} ago", view.fix->type,
                                                 view.fix->satellites, span(view.fix->received))
                                   : std::string("none received while listening");
  lines->push_back({fmt::format("  GPS fix {}; {:.0f} m since GPS", fix, nav.distance_since_gps_m),
                    view.fix ? Style::kPlain : Style::kWarning});
  std::string ages;
  for (const evaluation::TopView::Nav::Age& a : nav.ages) {
    ages += fmt::format("{}{} {}", ages.empty() ? "" : ", ", a.source, span(a.age));
  }
  lines->push_back({"  age: " + ages});
}

void append_integrity(const evaluation::TopView::Integrity& i, std::vector<TopLine>* lines) {
  const auto level = [&i](double level_m, double limit_m) {
    return i.bounded ? fmt::format("{:.2f} of {:.1f} m", level_m, limit_m)
                     : fmt::format("unbounded (limit {:.1f} m)", limit_m);
  };
  const bool silent = i.received > evaluation::TopModel::kSilent;
  lines->push_back({fmt::format("  protection level horizontal {}, vertical {}{}",
                                level(i.protection_horizontal_m, i.limit_horizontal_m),
                                level(i.protection_vertical_m, i.limit_vertical_m),
                                silent ? fmt::format(", SILENT {}", span(i.received)) : ""),
                    silent || !i.bounded ? Style::kAlarm : Style::kPlain});
  const std::string alerts = alert_names(i.alerts);
  const bool alert = alerts != "none";
  lines->push_back({fmt::format("  sources: INS {}, GPS {}, LADAR {}{}", i.ins, i.gps, i.ladar,
                                alert ? "" : "; no alerts")});
  if (alert) lines->push_back({"  alerts: " + alerts, Style::kAlarm});
}

void append_status(const char* node, const evaluation::TopView::Status& s, const char* suffix,
                   std::vector<TopLine>* lines) {
  const bool silent = s.received > evaluation::TopModel::kSilent;
  const std::string command = s.issuer.empty()
                                  ? "no command yet"
                                  : fmt::format("command {} of {}", s.echo_serial, s.issuer);
  lines->push_back({fmt::format("{} {} {}: {}{}{}, {}{}{}", node, s.status, s.state, command,
                                s.reason.empty() ? "" : ": ", s.reason, silent ? "SILENT " : "",
                                span(s.received), silent ? suffix : std::string(" ago") + suffix),
                    s.status == "ERROR" || silent ? Style::kAlarm : Style::kHead});
}

void append_bg(const evaluation::TopView::Status& s, std::vector<TopLine>* lines) {
  const bool stopped = s.emergency_stop != "none";
  append_status("bg", s, stopped ? "" : "; no emergency stop", lines);
  if (stopped) lines->push_back({"  emergency stop: " + s.emergency_stop, Style::kAlarm});
}

void append_mission(const evaluation::TopView& view, std::vector<TopLine>* lines) {
  append_status("mission", *view.mission, "", lines);
  if (!view.routes) return;
  const evaluation::TopView::Routes& r = *view.routes;
  const std::string of = fmt::format("of {} candidates, {} ago", r.candidates, span(r.received));
  if (!r.chosen) {
    lines->push_back({fmt::format("  route: none {}", of), Style::kWarning});
    return;
  }
  const std::string level = std::isfinite(r.chosen->level_max_m)
                                ? fmt::format("at most {:.1f} m without GPS (limit {:.1f} m)",
                                              r.chosen->level_max_m, r.alert_limit_m)
                                : "level not predicted";
  lines->push_back({fmt::format("  route: {:.0f} m, {:.0f} s, {}; {}", r.chosen->length_m,
                                r.chosen->time_s, level, of)});
}

/// @param first, last  events to append
void append_events(const evaluation::TopView& view, std::size_t first, std::size_t last,
                   std::vector<TopLine>* lines) {
  for (std::size_t k = first; k < std::min(last, view.events.size()); ++k) {
    const evaluation::TopView::Event& e = view.events[k];
    const std::string time =
        view.now_utime == 0 ? fmt::format("{} ago", span(e.age))
                            : fmt::format("{} UTC", time_of_day(view.now_utime - e.age.count()));
    lines->push_back({fmt::format("  {}{} {} {}: {}: {}{}", time,
                                  e.of_run ? fmt::format(" {:.1f} s", seconds(*e.of_run)) : "",
                                  e.node, severity_name(e.severity), e.code, e.text,
                                  e.repeated > 0 ? fmt::format(" (and {} times before)", e.repeated)
                                                 : std::string()),
                      style_of(e.severity)});
  }
}

const char* code_of(Style style) {
  switch (style) {
    case Style::kHead:
      return "\033[1m";
    case Style::kWarning:
      return "\033[33m";
    case Style::kAlarm:
      return "\033[1;31m";
    case Style::kPlain:
      break;
  }
  return "";
}

nlohmann::ordered_json json_ms(const std::optional<Duration>& d) {
  return d ? nlohmann::ordered_json(milliseconds(*d)) : nlohmann::ordered_json();
}

nlohmann::ordered_json json_number(const std::optional<double>& v) {
  return v ? nlohmann::ordered_json(*v) : nlohmann::ordered_json();
}

nlohmann::ordered_json json_node(const evaluation::TopView::Node& n) {
  nlohmann::ordered_json inputs = nlohmann::ordered_json::array();
  for (const evaluation::TopView::Input& in : n.inputs) {
    inputs.push_back({{"channel", in.channel},
                      {"rate_hz", json_number(in.rate_hz)},
                      {"age_ms", json_ms(in.age)},
                      {"dropped", in.dropped},
                      {"gaps", in.gaps},
                      {"malformed", in.malformed},
                      {"rejected", in.rejected}});
  }
  return {{"node", n.name},
          {"alive", n.alive},
          {"age_ms", json_ms(n.received)},
          {"pid", n.pid},
          {"publisher_id", id_text(n.publisher.publisher_id)},
          {"run_id", id_text(n.publisher.run_id)},
          {"up_s", seconds(n.up)},
          {"rate_hz", json_number(n.account_hz)},
          {"used_p50_ms", json_ms(n.used_p50)},
          {"used_max_ms", json_ms(n.used_max)},
          {"budget_ms", json_ms(n.budget)},
          {"min_slack_ms", json_ms(n.min_slack)},
          {"overruns", n.overruns},
          {"missed", n.missed},
          {"degrade_level", n.degrade_level},
          {"cpu_percent", json_number(n.cpu_percent)},
          {"rss_kb", n.rss_kb},
          {"heap_kb", n.heap_kb},
          {"descriptors", n.descriptors},
          {"realtime_priority", n.realtime_priority},
          {"memory_locked", n.memory_locked},
          {"note", n.note},
          {"inputs", inputs}};
}

nlohmann::ordered_json json_process(const evaluation::TopView::Process& p) {
  return {{"node", p.node},
          {"pid", p.pid},
          {"publisher_id", id_text(p.publisher.publisher_id)},
          {"run_id", id_text(p.publisher.run_id)}};
}

nlohmann::ordered_json json_rejected(const evaluation::TopView::Rejected& r) {
  return {{"channel", r.channel},
          {"rejected_by", r.by},
          {"publisher_id", id_text(r.publisher.publisher_id)},
          {"run_id", id_text(r.publisher.run_id)},
          {"process", r.process ? json_process(*r.process) : nlohmann::ordered_json()}};
}

nlohmann::ordered_json json_nav(const evaluation::TopView::Nav& nav) {
  nlohmann::ordered_json ages;
  for (const evaluation::TopView::Nav::Age& a : nav.ages) ages[a.source] = json_ms(a.age);
  return {{"age_ms", milliseconds(nav.received)},
          {"mode", nav.mode},
          {"pose_valid", nav.pose_valid},
          {"world_valid", nav.world_valid},
          {"sigma_m", nav.sigma_m},
          {"sigma_yaw_deg", degrees(nav.sigma_yaw_rad)},
          {"speed_mps", nav.speed_mps},
          {"distance_since_gps_m", nav.distance_since_gps_m},
          {"world_resets", nav.world_resets},
          {"map_epoch", nav.map_epoch},
          {"accepted_age_ms", ages}};
}

nlohmann::ordered_json json_status(const evaluation::TopView::Status& s) {
  return {{"age_ms", milliseconds(s.received)},
          {"status", s.status},
          {"state", s.state},
          {"reason", s.reason},
          {"echo_serial", s.echo_serial},
          {"issuer", s.issuer}};
}

nlohmann::ordered_json json_routes(const evaluation::TopView::Routes& r) {
  nlohmann::ordered_json out = {{"age_ms", milliseconds(r.received)},
                                {"candidates", r.candidates},
                                {"alert_limit_m", r.alert_limit_m},
                                {"chosen", nullptr}};
  if (r.chosen) {
    out["chosen"] = {{"length_m", r.chosen->length_m},
                     {"time_s", r.chosen->time_s},
                     {"level_max_m", std::isfinite(r.chosen->level_max_m)
                                         ? nlohmann::ordered_json(r.chosen->level_max_m)
                                         : nlohmann::ordered_json()}};
  }
  return out;
}

}  // namespace

std::vector<TopLine> top_lines(const evaluation::TopView& view) {
  constexpr std::size_t kNewest = 3;  // above the inputs: 24 rows show a whole vehicle
  std::vector<TopLine> lines;
  if (view.nodes.empty()) lines.push_back({"no node on this bus", Style::kAlarm});
  if (view.nav) append_nav(view, &lines);
  if (view.integrity) append_integrity(*view.integrity, &lines);
  if (view.mission) append_mission(view, &lines);
  if (view.status) append_bg(*view.status, &lines);
  if (!view.nodes.empty()) append_nodes(view, &lines);
  // With a second publisher they are part of what the operator needs at once.
  const bool second = !view.rejected.empty();
  append_rejected(view, &lines);
  if (second) append_processes(view, &lines);
  for (const auto& [channel, count] : view.malformed) {
    lines.push_back(
        {fmt::format("{}: {} messages cannot be decoded, possibly another version of the type",
                     channel, count),
         Style::kWarning});
  }
  if (!view.events.empty()) lines.push_back({"events, newest first", Style::kHead});
  append_events(view, 0, kNewest, &lines);
  append_inputs(view, &lines);
  if (!second) append_processes(view, &lines);
  if (view.events.size() > kNewest) lines.push_back({"older events", Style::kHead});
  append_events(view, kNewest, view.events.size(), &lines);
  return lines;
}

std::string plain_text(const std::vector<TopLine>& lines) {
  std::string text;
  for (const TopLine& line : lines) text += line.text + "\n";
  return text;
}

std::string screen_text(const std::vector<TopLine>& lines, const ScreenSize& size) {
  const auto columns = static_cast<std::size_t>(std::max(size.columns, 1));
  const auto rows = static_cast<std::size_t>(std::max(size.rows, 1));
  const bool cut = lines.size() > rows;
  const std::size_t shown = cut ? rows - 1 : lines.size();
  std::string text = "\033[H";  // home
  for (std::size_t i = 0; i < shown; ++i) {
    // Each line erases the rest of its row; the last one has no line end, which would scroll.
    text += fmt::format("{}{}\033[0m\033[K{}", code_of(lines[i].style),
                        lines[i].text.substr(0, columns), i + 1 < rows ? "\r\n" : "");
  }
  if (cut) {
    text += fmt::format("... {} more lines", lines.size() - shown).substr(0, columns) + "\033[K";
  }
  return text + "\033[J";
}

nlohmann::ordered_json to_json(const evaluation::TopView& view) {
  nlohmann::ordered_json out = {{"nodes", nlohmann::ordered_json::array()},
                                {"processes", nlohmann::ordered_json::array()},
                                {"rejected", nlohmann::ordered_json::array()},
                                {"malformed", view.malformed}};
  for (const evaluation::TopView::Node& n : view.nodes) out["nodes"].push_back(json_node(n));
  for (const evaluation::TopView::Process& p : view.processes) {
    out["processes"].push_back(json_process(p));
  }
  for (const evaluation::TopView::Rejected& r : view.rejected) {
    out["rejected"].push_back(json_rejected(r));
  }
  if (view.nav) out["nav"] = json_nav(*view.nav);
  if (view.status) out["bg"] = json_status(*view.status);
  if (view.mission) out["mission"] = json_status(*view.mission);
  if (view.routes) out["routes"] = json_routes(*view.routes);
  out["events"] = nlohmann::ordered_json::array();
  for (const evaluation::TopView::Event& e : view.events) {
    out["events"].push_back({{"age_ms", milliseconds(e.age)},
                             {"node", e.node},
                             {"severity", severity_name(e.severity)},
                             {"code", e.code},
                             {"text", e.text},
                             {"repeated", e.repeated}});
  }
  return out;
}

}  // namespace rcs::cli

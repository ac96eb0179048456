#include "tools/rcs/vehicle/top_screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "lcmtypes/rcs/event_t.hpp"
#include "rcs/base/linear.h"
#include "tools/report/table.h"

namespace rcs::cli {
namespace {

using Style = TopLine::Style;

std::string ms(const std::optional<Duration>& d) {
  return d ? fmt::format("{:.2f}", milliseconds(*d)) : "-";
}

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
  return n.heard ? fmt::format("SILENT {}", span(*n.heard)) : "no process_t";
}

std::string scheduling_of(const evaluation::TopView::Node& n) {
  std::string text = n.realtime_priority > 0 ? fmt::format("FIFO {}", n.realtime_priority) : "no";
  return n.memory_locked ? text + "+lock" : text;
}

Style style_of(const evaluation::TopView::Node& n) {
  if (!n.alive) return Style::kAlarm;
  const bool late = n.min_slack && *n.min_slack < Duration::zero();
  return late || n.degrade_level > 0 ? Style::kWarning : Style::kPlain;
}

/// The lines of the table; its rows with their styles.
void append(const report::Table& table, const std::vector<Style>& styles,
            std::vector<TopLine>* lines) {
  const std::string text = to_text(table);
  std::size_t row = 0;
  for (std::size_t at = 0; at < text.size(); ++row) {
    const std::size_t end = text.find('\n', at);
    lines->push_back({text.substr(at, end - at), row == 0 ? Style::kHead : styles[row - 1]});
    at = end + 1;
  }
}

void append_nodes(const evaluation::TopView& view, std::vector<TopLine>* lines) {
  report::Table table;
  table.header = {"node",  "state", "up",     "Hz",    "p50 ms", "max ms", "budget",
                  "slack", "over",  "missed", "level", "cpu %",  "rss MB", "real time"};
  std::vector<Style> styles;
  for (const evaluation::TopView::Node& n : view.nodes) {
    table.rows.push_back(
        {n.name, state_of(n), n.heard ? span(n.up) : "-", number(n.account_hz), ms(n.used_p50),
         ms(n.used_max), ms(n.budget), ms(n.min_slack), std::to_string(n.overruns),
         std::to_string(n.missed), std::to_string(n.degrade_level), number(n.cpu_percent),
         fmt::format("{:.1f}", static_cast<double>(n.rss_kb) / 1024.0), scheduling_of(n)});
    styles.push_back(style_of(n));
  }
  append(table, styles, lines);
  for (const evaluation::TopView::Node& n : view.nodes) {
    if (!n.note.empty()) {
      lines->push_back({fmt::format("{}: {}", n.name, n.note), Style::kWarning});
    }
  }
  lines->push_back({});
}

void append_inputs(const evaluation::TopView& view, std::vector<TopLine>* lines) {
  report::Table table;
  table.header = {"input", "Hz", "age", "dropped", "gaps", "malformed"};
  std::vector<Style> styles;
  for (const evaluation::TopView::Node& n : view.nodes) {
    for (const evaluation::TopView::Input& in : n.inputs) {
      table.rows.push_back({fmt::format("{} {}", n.name, in.channel), number(in.rate_hz),
                            span(in.age), std::to_string(in.dropped), std::to_string(in.gaps),
                            std::to_string(in.malformed)});
      styles.push_back(in.malformed > 0 ? Style::kWarning : Style::kPlain);
    }
  }
  if (table.rows.empty()) return;
  append(table, styles, lines);
  lines->push_back({});
}

void append_nav(const evaluation::TopView::Nav& nav, std::vector<TopLine>* lines) {
  const bool silent = nav.heard > evaluation::TopModel::kSilent;
  lines->push_back(
      {fmt::format("wm {}{}{}{}", nav.mode, nav.pose_valid ? "" : ", POSE INVALID",
                   nav.world_valid ? "" : ", no datum yet",
                   silent ? fmt::format(", SILENT {}", span(nav.heard)) : ""),
       silent || !nav.pose_valid || nav.mode == "LOST" ? Style::kAlarm : Style::kHead});
  lines->push_back({fmt::format(
      "  sigma {:.2f} m forward, {:.2f} m left, {:.2f} m up, {:.2f} deg yaw; {:.1f} m/s",
      nav.sigma_m[0], nav.sigma_m[1], nav.sigma_m[2], degrees(nav.sigma_yaw_rad), nav.speed_mps)});
  lines->push_back({fmt::format("  {:.0f} m since GPS, {} resets of world, map epoch {}",
                                nav.distance_since_gps_m, nav.world_resets, nav.map_epoch)});
  std::string ages;
  for (const evaluation::TopView::Nav::Age& a : nav.ages) {
    ages += fmt::format("{}{} {}", ages.empty() ? "" : ", ", a.source, span(a.age));
  }
  lines->push_back({"  since accepted: " + ages});
  lines->push_back({});
}

void append_status(const evaluation::TopView::Status& s, std::vector<TopLine>* lines) {
  lines->push_back({fmt::format("bg {} {}: command {} of {}{}{}, {} ago", s.status, s.state,
                                s.echo_serial, s.issuer.empty() ? "nobody" : s.issuer,
                                s.reason.empty() ? "" : ": ", s.reason, span(s.heard)),
                    s.status == "ERROR" ? Style::kAlarm : Style::kHead});
  lines->push_back({});
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
                      {"malformed", in.malformed}});
  }
  return {{"node", n.name},
          {"alive", n.alive},
          {"age_ms", json_ms(n.heard)},
          {"pid", n.pid},
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

nlohmann::ordered_json json_nav(const evaluation::TopView::Nav& nav) {
  nlohmann::ordered_json ages;
  for (const evaluation::TopView::Nav::Age& a : nav.ages) ages[a.source] = json_ms(a.age);
  return {{"age_ms", milliseconds(nav.heard)},
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

}  // namespace

std::vector<TopLine> top_lines(const evaluation::TopView& view) {
  std::vector<TopLine> lines;
  if (view.nodes.empty()) lines.push_back({"no node on this bus", Style::kAlarm});
  if (!view.nodes.empty()) append_nodes(view, &lines);
  if (view.nav) append_nav(*view.nav, &lines);
  if (view.status) append_status(*view.status, &lines);
  append_inputs(view, &lines);
  for (const auto& [channel, count] : view.malformed) {
    lines.push_back(
        {fmt::format("{}: {} messages cannot be decoded, possibly another version of the type",
                     channel, count),
         Style::kWarning});
  }
  if (!view.events.empty()) lines.push_back({"events, newest first", Style::kHead});
  for (const evaluation::TopView::Event& e : view.events) {
    lines.push_back({fmt::format("  {:>8} ago  {} {}: {}: {}{}", span(e.age), e.node,
                                 severity_name(e.severity), e.code, e.text,
                                 e.repeated > 0 ? fmt::format(" (and {} times before)", e.repeated)
                                                : std::string()),
                     style_of(e.severity)});
  }
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
                                {"malformed", view.malformed}};
  for (const evaluation::TopView::Node& n : view.nodes) out["nodes"].push_back(json_node(n));
  if (view.nav) out["nav"] = json_nav(*view.nav);
  if (view.status) {
    const evaluation::TopView::Status& s = *view.status;
    out["bg"] = {{"age_ms", milliseconds(s.heard)},
                 {"status", s.status},
                 {"state", s.state},
                 {"reason", s.reason},
                 {"echo_serial", s.echo_serial},
                 {"issuer", s.issuer}};
  }
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

#include "tools/view/run_status.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <type_traits>
#include <utility>

#include "lcmtypes/channel_types.h"
#include "lcmtypes/channels.h"
#include "lcmtypes/message_names.h"

namespace rcs::view {
namespace {

using evaluation::TopView;
using Json = nlohmann::ordered_json;

Json ms_of(const std::optional<Duration>& d) { return d ? Json(milliseconds(*d)) : Json(); }
Json s_of(const std::optional<Duration>& d) { return d ? Json(seconds(*d)) : Json(); }

Json to_json(const TopView::Node& n) {
  Json inputs = Json::array();
  for (const TopView::Input& i : n.inputs) {
    inputs.push_back({{"channel", i.channel},
                      {"rate_hz", i.rate_hz ? Json(*i.rate_hz) : Json()},
                      {"age_s", s_of(i.age)},
                      {"dropped", i.dropped},
                      {"gaps", i.gaps},
                      {"malformed", i.malformed},
                      {"rejected", i.rejected}});
  }
  return {{"node", n.name},
          {"alive", n.alive},
          {"rate_hz", n.account_hz ? Json(*n.account_hz) : Json()},
          {"p50_ms", ms_of(n.used_p50)},
          {"p99_ms", ms_of(n.used_p99)},
          {"max_ms", ms_of(n.used_max)},
          {"budget_ms", ms_of(n.budget)},
          {"overruns", n.overruns},
          {"missed", n.missed},
          {"degrade_level", n.degrade_level},
          {"cpu_percent", n.cpu_percent ? Json(*n.cpu_percent) : Json()},
          {"rss_mb", static_cast<double>(n.rss_kb) / 1024.0},
          {"note", n.note},
          {"inputs", std::move(inputs)}};
}

Json to_json(const TopView::Status& s) {
  return {
      {"age_s", seconds(s.received)}, {"status", s.status}, {"state", s.state},
      {"reason", s.reason},           {"issuer", s.issuer}, {"emergency_stop", s.emergency_stop}};
}

Json to_json(const TopView::Routes& r) {
  Json out = {{"age_s", seconds(r.received)},
              {"candidates", r.candidates},
              {"alert_limit_m", r.alert_limit_m}};
  if (r.chosen) {
    out["chosen"] = {{"length_m", r.chosen->length_m},
                     {"time_s", r.chosen->time_s},
                     {"level_max_m",
                      std::isfinite(r.chosen->level_max_m) ? Json(r.chosen->level_max_m) : Json()}};
  }
  return out;
}

/// Writes samples of the format 0.0.4.
class MetricsWriter {
 public:
  void describe(const char* name, const char* type, const char* help) {
    text_ += fmt::format("# HELP {} {}\n# TYPE {} {}\n", name, help, name, type);
  }
  /// @param labels  "node=\"sp\"", or empty
  void sample(const char* name, const std::string& labels, double value) {
    const std::string number = std::isnan(value)   ? "NaN"
                               : std::isinf(value) ? (value > 0 ? "+Inf" : "-Inf")
                                                   : fmt::format("{:.9g}", value);
    text_ += labels.empty() ? fmt::format("{} {}\n", name, number)
                            : fmt::format("{}{{{}}} {}\n", name, labels, number);
  }
  void count(const char* name, const std::string& labels, std::int64_t value) {
    text_ += labels.empty() ? fmt::format("{} {}\n", name, value)
                            : fmt::format("{}{{{}}} {}\n", name, labels, value);
  }
  [[nodiscard]] std::string take() { return std::move(text_); }

 private:
  std::string text_;
};

std::string label(const char* name, std::string_view value) {
  std::string escaped;
  for (const char c : value) {
    if (c == '\\' || c == '"') escaped += '\\';
    escaped += c == '\n' ? ' ' : c;
  }
  return fmt::format("{}=\"{}\"", name, escaped);
}

void write_nodes(const TopView& view, MetricsWriter* out) {
  out->describe("rcs_node_up", "gauge",
                "1 if the node has published its statistics in the last 3 s.");
  for (const TopView::Node& n : view.nodes) {
    out->count("rcs_node_up", label("node", n.name), n.alive ? 1 : 0);
  }
  out->describe("rcs_node_cycle_seconds", "gauge",
                "Wall time of the cycles of the last 5 s, by quantile.");
  for (const TopView::Node& n : view.nodes) {
    const auto quantile = [&](const char* q, const std::optional<Duration>& d) {
      if (!d) return;
      out->sample("rcs_node_cycle_seconds", label("node", n.name) + "," + label("quantile", q),
                  seconds(*d));
    };
    quantile("0.5", n.used_p50);
    quantile("0.99", n.used_p99);
    quantile("1", n.used_max);
  }
  const auto counter = [&](const char* name, const char* help, const auto& value) {
    out->describe(name, "counter", help);
    for (const TopView::Node& n : view.nodes) {
      out->count(name, label("node", n.name), value(n));
    }
  };
  counter("rcs_node_overruns_total", "Cycles that ended after their deadline.",
          [](const TopView::Node& n) { return n.overruns; });
  counter("rcs_node_missed_total", "Cycles that were skipped to keep the phase.",
          [](const TopView::Node& n) { return n.missed; });
  out->describe("rcs_node_degrade_level", "gauge", "Work that the node leaves out; 0: none.");
  for (const TopView::Node& n : view.nodes) {
    out->count("rcs_node_degrade_level", label("node", n.name), n.degrade_level);
  }
  out->describe("rcs_node_resident_bytes", "gauge", "Resident memory.");
  for (const TopView::Node& n : view.nodes) {
    out->count("rcs_node_resident_bytes", label("node", n.name), n.rss_kb * 1024);
  }
  out->describe("rcs_node_cpu_ratio", "gauge", "CPU time over wall time, of the last 5 s.");
  for (const TopView::Node& n : view.nodes) {
    if (n.cpu_percent) {
      out->sample("rcs_node_cpu_ratio", label("node", n.name), *n.cpu_percent / 100.0);
    }
  }
  out->describe("rcs_input_age_seconds", "gauge", "Since the last message of an input of a node.");
  for (const TopView::Node& n : view.nodes) {
    for (const TopView::Input& i : n.inputs) {
      if (!i.age) continue;
      out->sample("rcs_input_age_seconds",
                  label("node", n.name) + "," + label("channel", i.channel), seconds(*i.age));
    }
  }
}

void write_navigation(const TopView& view, MetricsWriter* out) {
  if (view.nav) {
    const TopView::Nav& nav = *view.nav;
    out->describe("rcs_navigation_mode", "gauge",
                  "1 for the current mode of WM, 0 for the others.");
    for (int mode = 0; mode <= nav_state_t::MODE_LOST; ++mode) {
      const std::string_view name = nav_mode_name(mode);
      out->count("rcs_navigation_mode", label("mode", name), nav.mode == name ? 1 : 0);
    }
    out->describe("rcs_pose_valid", "gauge", "1 if the pose in frame local is valid.");
    out->count("rcs_pose_valid", "", nav.pose_valid ? 1 : 0);
    out->describe("rcs_world_valid", "gauge", "1 if the pose is georeferenced.");
    out->count("rcs_world_valid", "", nav.world_valid ? 1 : 0);
    out->describe("rcs_navigation_age_seconds", "gauge", "Since the last WM_NAV_STATE.");
    out->sample("rcs_navigation_age_seconds", "", seconds(nav.received));
    out->describe("rcs_source_age_seconds", "gauge",
                  "Since the last measurement of a source that WM accepted.");
    for (const TopView::Nav::Age& age : nav.ages) {
      if (age.age) {
        out->sample("rcs_source_age_seconds", label("source", age.source), seconds(*age.age));
      }
    }
    out->describe("rcs_speed_mps", "gauge", "Speed of the vehicle.");
    out->sample("rcs_speed_mps", "", nav.speed_mps);
    out->describe("rcs_distance_since_gps_meters", "gauge", "Driven since the last accepted fix.");
    out->sample("rcs_distance_since_gps_meters", "", nav.distance_since_gps_m);
  }
  if (view.integrity) {
    const TopView::Integrity& i = *view.integrity;
    out->describe("rcs_protection_level_meters", "gauge",
                  "Bound of the position error; +Inf: no bound is known.");
    out->sample("rcs_protection_level_meters", label("axis", "horizontal"),
                i.bounded ? i.protection_horizontal_m : INFINITY);
    out->sample("rcs_protection_level_meters", label("axis", "vertical"),
                i.bounded ? i.protection_vertical_m : INFINITY);
    out->describe("rcs_alert_limit_meters", "gauge", "Alert limit of the protection level.");
    out->sample("rcs_alert_limit_meters", label("axis", "horizontal"), i.limit_horizontal_m);
    out->sample("rcs_alert_limit_meters", label("axis", "vertical"), i.limit_vertical_m);
    out->describe("rcs_alerts", "gauge", "Bits of integrity_t.alerts.");
    out->count("rcs_alerts", "", i.alerts);
    out->describe("rcs_source_status", "gauge", "1 for the current status of a source.");
    for (const auto& [source, status] :
         {std::pair("ins", i.ins), std::pair("gps", i.gps), std::pair("ladar", i.ladar)}) {
      out->count("rcs_source_status", label("source", source) + "," + label("status", status), 1);
    }
  }
  if (view.status) {
    out->describe("rcs_bg_state", "gauge", "1 for the current state of BG.");
    out->count("rcs_bg_state", label("state", view.status->state), 1);
  }
  if (view.mission) {
    out->describe("rcs_mission_state", "gauge", "1 for the current state of the mission.");
    out->count("rcs_mission_state", label("state", view.mission->state), 1);
  }
}

void write_viewer(const ViewerCounts& c, MetricsWriter* out) {
  const auto write = [out](const char* name, const char* type, const char* help,
                           std::int64_t value) {
    out->describe(name, type, help);
    out->count(name, "", value);
  };
  write("rcs_view_clients", "gauge", "Clients that are connected.", c.clients);
  write("rcs_view_messages_received_total", "counter", "Messages of the bus or of the log.",
        c.messages_received);
  write("rcs_view_messages_sent_total", "counter", "Messages that were sent to clients.",
        c.messages_sent);
  write("rcs_view_bytes_sent_total", "counter", "Bytes that were sent to clients.", c.bytes_sent);
  write("rcs_view_messages_dropped_total", "counter",
        "Messages that were replaced by newer ones before a client received them.",
        c.messages_dropped);
  write("rcs_view_clients_dropped_total", "counter",
        "Clients that were dropped: they did not read.", c.clients_dropped);
  write("rcs_view_messages_malformed_total", "counter",
        "Messages that are not of the type of their channel.", c.malformed);
  write("rcs_view_bytes_waiting", "gauge", "Bytes that wait for clients.", c.bytes_waiting);
}

}  // namespace

ChannelSet status_channels() {
  static const ChannelSet kSet = channels_of(
      "*_PROCESS, *_CYCLE, *_EVENT, WM_NAV_STATE, WM_INTEGRITY, GPS_FIX, BG_STATUS, "
      "MISSION_STATUS, MISSION_ROUTES");
  return kSet;
}

void RunStatus::add(const SourceMessage& message) {
  using evaluation::TopModel;
  const Stamp arrival = stamp(message.time);
  channel::with_type_of(message.channel, [&](const auto* type) {
    using T = std::remove_const_t<std::remove_pointer_t<decltype(type)>>;
    [[maybe_unused]] const auto pass = [&](void (TopModel::*on)(const T&, Stamp)) {
      T m{};
      const int bytes = static_cast<int>(message.size);
      if (m.decode(message.data, 0, bytes) == bytes) (model_.*on)(m, arrival);
    };
    if constexpr (std::is_same_v<T, process_t>) pass(&TopModel::on_process);
    if constexpr (std::is_same_v<T, cycle_t>) pass(&TopModel::on_cycle);
    if constexpr (std::is_same_v<T, event_t>) pass(&TopModel::on_event);
    if constexpr (std::is_same_v<T, nav_state_t>) pass(&TopModel::on_nav);
    if constexpr (std::is_same_v<T, integrity_t>) pass(&TopModel::on_integrity);
    if constexpr (std::is_same_v<T, gps_fix_t>) pass(&TopModel::on_fix);
    if constexpr (std::is_same_v<T, status_t>) {
      pass(message.channel == channel::kMissionStatus ? &TopModel::on_mission
                                                      : &TopModel::on_status);
    }
    if constexpr (std::is_same_v<T, routes_t>) pass(&TopModel::on_routes);
  });
}

Json to_json(const TopView& view) {
  Json out = {{"nodes", Json::array()}, {"events", Json::array()}};
  for (const TopView::Node& n : view.nodes) out["nodes"].push_back(to_json(n));
  if (view.nav) {
    const TopView::Nav& n = *view.nav;
    Json ages = Json::object();
    for (const TopView::Nav::Age& age : n.ages) ages[age.source] = s_of(age.age);
    out["nav"] = {{"age_s", seconds(n.received)},
                  {"mode", n.mode},
                  {"pose_valid", n.pose_valid},
                  {"world_valid", n.world_valid},
                  {"p_world_m", {n.p_world_m[0], n.p_world_m[1], n.p_world_m[2]}},
                  {"lat_deg", n.lat_deg},
                  {"lon_deg", n.lon_deg},
                  {"heading_deg", n.heading_deg},
                  {"sigma_m", {n.sigma_m[0], n.sigma_m[1], n.sigma_m[2]}},
                  {"sigma_yaw_rad", n.sigma_yaw_rad},
                  {"speed_mps", n.speed_mps},
                  {"distance_since_gps_m", n.distance_since_gps_m},
                  {"world_resets", n.world_resets},
                  {"map_epoch", n.map_epoch},
                  {"source_age_s", std::move(ages)}};
  }
  if (view.integrity) {
    const TopView::Integrity& i = *view.integrity;
    out["integrity"] = {
        {"age_s", seconds(i.received)},
        {"bounded", i.bounded},
        {"protection_horizontal_m", i.bounded ? Json(i.protection_horizontal_m) : Json()},
        {"protection_vertical_m", i.bounded ? Json(i.protection_vertical_m) : Json()},
        {"limit_horizontal_m", i.limit_horizontal_m},
        {"limit_vertical_m", i.limit_vertical_m},
        {"alerts", alert_names(i.alerts)},
        {"ins", i.ins},
        {"gps", i.gps},
        {"ladar", i.ladar}};
  }
  if (view.fix) {
    out["fix"] = {{"age_s", seconds(view.fix->received)},
                  {"type", view.fix->type},
                  {"satellites", view.fix->satellites}};
  }
  if (view.status) out["bg"] = to_json(*view.status);
  if (view.mission) out["mission"] = to_json(*view.mission);
  if (view.routes) out["routes"] = to_json(*view.routes);
  for (const TopView::Event& e : view.events) {
    out["events"].push_back({{"age_s", seconds(e.age)},
                             {"node", e.node},
                             {"severity", e.severity},
                             {"code", e.code},
                             {"text", e.text}});
  }
  return out;
}

std::string metrics_text(const TopView& view, const ViewerCounts& counts) {
  MetricsWriter out;
  write_nodes(view, &out);
  write_navigation(view, &out);
  write_viewer(counts, &out);
  return out.take();
}

}  // namespace rcs::view

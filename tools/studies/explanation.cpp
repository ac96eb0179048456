#include "tools/studies/explanation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/message_names.h"
#include "rcs/base/printable.h"
#include "rcs/node/time_text.h"
#include "tools/evaluation/route_json.h"
#include "tools/evaluation/top_model.h"
#include "tools/recording/run_log.h"
#include "tools/studies/explanation_text.h"
#include "tools/studies/message_history.h"

namespace rcs::studies {
namespace {

using Json = nlohmann::ordered_json;

double age_s(Stamp moment, Stamp arrival) { return seconds(moment - arrival); }

Json inputs_json(const MessageHistory& history, Stamp moment) {
  Json json = Json::array();
  for (const auto& [name, arrivals] : history.inputs) {
    const auto recent = std::count_if(arrivals.begin(), arrivals.end(), [&](Stamp s) {
      return moment - s <= MessageHistory::kRecent;
    });
    json.push_back(
        {{"channel", name}, {"age_s", age_s(moment, arrivals.back())}, {"in_last_second", recent}});
  }
  return json;
}

/// Of the last second.
Json measurements_json(const MessageHistory& history, Stamp moment) {
  Json json = Json::array();
  for (const Received<innovation_t>& i : history.innovations) {
    if (moment - i.arrival > MessageHistory::kRecent) continue;
    const innovation_t& m = i.message;
    json.push_back({{"source", innovation_source_name(m.source)},
                    {"age_s", age_s(moment, i.arrival)},
                    {"accepted", m.accepted != 0},
                    {"reason", innovation_reason_name(m.reason)},
                    {"nis", m.nis},
                    {"gate", m.gate}});
  }
  return json;
}

Json registrations_json(const MessageHistory& history, Stamp moment) {
  Json json = Json::array();
  for (const Received<registration_t>& r : history.registrations) {
    const registration_t& m = r.message;
    const bool rolling = m.target == registration_t::TARGET_ROLLING;
    json.push_back({{"scan", m.scan_id},
                    {"target", rolling ? "rolling map" : "a priori map"},
                    {"age_s", age_s(moment, r.arrival)},
                    {"stop", recording::stop_name(m.stop)},
                    {"points", m.points},
                    {"pairs", m.pairs},
                    {"overlap", m.overlap},
                    {"correction_m", m.correction_m},
                    {"correction_deg", degrees(m.correction_rad)},
                    {"used_units", m.used_units},
                    {"granted_units", m.granted_units},
                    {"degrade_level", m.degrade_level}});
  }
  return json;
}

Json belief_json(const MessageHistory& history, Stamp moment) {
  if (history.nav.empty()) return nullptr;
  const nav_state_t& m = history.nav.back().message;
  const Mat6 cov = from_message(m.cov_world_pose);
  const auto sigma = [&cov](int i) { return std::sqrt(std::max(0.0, cov(i, i))); };
  const auto age = [](std::int64_t us) { return us < 0 ? Json() : Json(seconds(Duration(us))); };
  return {{"age_s", age_s(moment, history.nav.back().arrival)},
          {"mode", nav_mode_name(m.mode)},
          {"world_valid", m.world_valid != 0},
          {"sigma_m", {sigma(0), sigma(1), sigma(2)}},
          {"sigma_yaw_deg", degrees(sigma(5))},
          {"accepted_age_s",
           {{"ins", age(m.age_ins_us)},
            {"gps", age(m.age_gps_us)},
            {"odometry", age(m.age_odometry_us)},
            {"rolling_map", age(m.age_rolling_us)},
            {"prior_map", age(m.age_prior_map_us)}}},
          {"distance_since_gps_m", m.distance_since_gps_m},
          {"world_resets", m.world_resets}};
}

Json integrity_json(const MessageHistory& history, Stamp moment) {
  if (history.integrity.empty()) return nullptr;
  const integrity_t& m = history.integrity.back().message;
  const auto source = [&m](int status, std::int64_t since, double ratio) {
    return Json{{"status", source_status_name(status)},
                {"for_s", seconds(Duration(m.utime - since))},
                {"test_ratio", ratio}};
  };
  return {{"age_s", age_s(moment, history.integrity.back().arrival)},
          {"protection_horizontal_m", m.protection_horizontal_m},
          {"protection_vertical_m", m.protection_vertical_m},
          {"limit_horizontal_m", m.limit_horizontal_m},
          {"limit_vertical_m", m.limit_vertical_m},
          {"alerts", alert_names(m.alerts)},
          {"ins",
           {{"status", source_status_name(m.ins)},
            {"for_s", seconds(Duration(m.utime - m.ins_since_utime))}}},
          {"gps", source(m.gps, m.gps_since_utime, m.gps_test_ratio)},
          {"ladar", source(m.ladar, m.ladar_since_utime, m.ladar_test_ratio)}};
}

Json driving_json(const MessageHistory& history, Stamp moment) {
  Json json = {{"status", nullptr}, {"drive", nullptr}, {"plan", nullptr}};
  if (!history.status.empty()) {
    const status_t& m = history.status.back().message;
    json["status"] = {{"age_s", age_s(moment, history.status.back().arrival)},
                      {"state", m.state},
                      {"reason", m.reason}};
  }
  if (!history.drive.empty()) {
    const drive_t& m = history.drive.back().message;
    json["drive"] = {{"age_s", age_s(moment, history.drive.back().arrival)},
                     {"speed_mps", m.speed_mps},
                     {"curvature_1pm", m.curvature_1pm},
                     {"brake", m.brake != 0}};
  }
  if (!history.plan.empty()) {
    const plan_t& m = history.plan.back().message;
    json["plan"] = {{"age_s", age_s(moment, history.plan.back().arrival)},
                    {"points", m.n},
                    {"cost", m.cost},
                    {"issuer", m.issuer},
                    {"serial", m.serial}};
  }
  return json;
}

Json mission_json(const MessageHistory& history, Stamp moment) {
  Json json = {{"status", nullptr}, {"routes", nullptr}};
  if (!history.mission_status.empty()) {
    const status_t& m = history.mission_status.back().message;
    json["status"] = {{"age_s", age_s(moment, history.mission_status.back().arrival)},
                      {"state", m.state},
                      {"reason", m.reason}};
  }
  if (history.routes.empty()) return json;
  json["routes"] = evaluation::route_choice_json(history.routes.back().message);
  json["routes"]["age_s"] = age_s(moment, history.routes.back().arrival);
  return json;
}

Json to_json(const MessageHistory& history, Stamp moment) {
  Json json = {{"inputs", inputs_json(history, moment)},
               {"measurements", measurements_json(history, moment)},
               {"registrations", registrations_json(history, moment)},
               {"belief", belief_json(history, moment)},
               {"integrity", integrity_json(history, moment)},
               {"mission", mission_json(history, moment)},
               {"bg", driving_json(history, moment)},
               {"events", Json::array()}};
  for (const Received<event_t>& e : history.events) {
    if (moment - e.arrival > MessageHistory::kEvents) continue;
    json["events"].push_back({{"age_s", age_s(moment, e.arrival)},
                              {"node", evaluation::printable(e.message.node)},
                              {"code", evaluation::printable(e.message.code)},
                              {"text", evaluation::printable(e.message.text)}});
  }
  return json;
}

Json route_choice_json(const Received<routes_t>& choice, Stamp begin) {
  const routes_t& m = choice.message;
  Json json = {{"time_s", seconds(choice.arrival - begin)},
               {"log_utime", to_utime(choice.arrival)},
               {"issuer", printable_line(m.issuer)}};
  json.update(evaluation::route_choice_json(m));
  for (std::size_t k = 0; k < m.route.size(); ++k) {
    json["candidates"][k]["reason"] = route_reason(m.route[k], m);
  }
  return json;
}

}  // namespace

Explanation explanation_of(const MessageHistory& history, const std::string& log, Stamp begin,
                           Stamp moment) {
  const double time_s = seconds(moment - begin);
  Json json = {{"log", log}, {"time_s", time_s}, {"log_utime", to_utime(moment)}};
  json.update(to_json(history, moment));
  return {fmt::format("{}, {:.3f} s after its begin: {} {} UTC\n\n", log, time_s,
                      utc_date(to_utime(moment)), time_of_day(to_utime(moment))) +
              explanation_text(history, begin, moment),
          std::move(json)};
}

Result<Explanation> explain(LogReader* log, Duration after,
                            const std::function<bool(double)>& progress) {
  MessageHistory history;
  LogEvent event;
  std::optional<Stamp> begin;
  while (log->next(&event)) {
    if (!begin) begin = event.stamp;
    if (!progress(static_cast<double>(log->position_bytes()) /
                  static_cast<double>(log->size_bytes()))) {
      return Error{"interrupted"};
    }
    const Stamp moment = *begin + after;
    if (event.stamp > moment) return explanation_of(history, log->path(), *begin, moment);
    history.add(event);
  }
  if (!begin) return Error{log->path() + ": no LCM log, or it is empty"};
  return Error{
      fmt::format("{}: the log ends after {:.1f} s", log->path(), seconds(history.now - *begin))};
}

Explanation explanation_of_routes(const std::vector<Received<routes_t>>& choices,
                                  const std::string& log, Stamp begin) {
  Json json = {{"log", log}, {"choices", Json::array()}};
  std::string text = choices.empty()
                         ? fmt::format("{}: the mission has chosen no route\n", log)
                         : fmt::format("{}: choices of a route: {}\n\n", log, choices.size());
  for (const Received<routes_t>& choice : choices) {
    json["choices"].push_back(route_choice_json(choice, begin));
    text += fmt::format("{:.1f} s after the begin of the log\n", seconds(choice.arrival - begin)) +
            route_choice_text(choice.message) + "\n";
  }
  return {std::move(text), std::move(json)};
}

Result<Explanation> explain_routes(LogReader* log, const std::function<bool(double)>& progress) {
  std::vector<Received<routes_t>> choices;
  LogEvent event;
  std::optional<Stamp> begin;
  while (log->next(&event)) {
    if (!begin) begin = event.stamp;
    if (!progress(static_cast<double>(log->position_bytes()) /
                  static_cast<double>(log->size_bytes()))) {
      return Error{"interrupted"};
    }
    if (event.channel != channel::kMissionRoutes) continue;
    Received<routes_t> choice{event.stamp, {}};
    const int size = static_cast<int>(event.data.size());
    if (choice.message.decode(event.data.data(), 0, size) == size) {
      choices.push_back(std::move(choice));
    }
  }
  if (!begin) return Error{log->path() + ": no LCM log, or it is empty"};
  return explanation_of_routes(choices, log->path(), *begin);
}

}  // namespace rcs::studies

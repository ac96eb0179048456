#include "tools/studies/explanation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/message_names.h"
#include "lcmtypes/rcs/drive_t.hpp"
#include "lcmtypes/rcs/event_t.hpp"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/plan_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "lcmtypes/rcs/status_t.hpp"
#include "rcs/node/time_text.h"
#include "tools/drills/drill_metrics.h"
#include "tools/evaluation/top_model.h"
#include "tools/recording/run_log.h"
#include "tools/report/table.h"

namespace rcs::studies {
namespace {

using Json = nlohmann::ordered_json;

constexpr Duration kRecent = std::chrono::seconds(1);
constexpr Duration kEvents = std::chrono::seconds(30);
constexpr std::size_t kRegistrations = 4;
constexpr std::size_t kRefusals = 12;
constexpr std::size_t kEventsShown = 12;

template <class T>
struct Received {
  Stamp arrival;
  T message{};
};

std::string ago(Duration d) {
  const double s = seconds(d);
  return s < 1.0 ? fmt::format("{:.0f} ms ago", 1e3 * s) : fmt::format("{:.1f} s ago", s);
}

/// Messages received up to the moment.
class History {
 public:
  void add(const LogEvent& event) {
    now_ = event.stamp;
    Input& input = inputs_[event.channel];
    input.recent.push_back(event.stamp);
    while (event.stamp - input.recent.front() > kRecent) input.recent.pop_front();
    const std::string& c = event.channel;
    if (c == channel::kWmInnovation) with<innovation_t>(event, &innovations_, 2000);
    if (c == channel::kSpRegistration) with<registration_t>(event, &registrations_, kRegistrations);
    if (c == channel::kWmNavState) with<nav_state_t>(event, &nav_, 1);
    if (c == channel::kWmIntegrity) with<integrity_t>(event, &integrity_, 1);
    if (c == channel::kBgDrive) with<drive_t>(event, &drive_, 1);
    if (c == channel::kBgPlan) with<plan_t>(event, &plan_, 1);
    if (c == channel::kBgStatus) with<status_t>(event, &status_, 1);
    const bool is_event =
        c == channel::kSpEvent || c == channel::kWmEvent || c == channel::kBgEvent;
    if (is_event) with<event_t>(event, &events_, kEventsShown);
  }

  [[nodiscard]] std::string text(Stamp begin, Stamp moment) const {
    return inputs_text(moment) + considered_text(moment) + registrations_text(moment) +
           belief_text(moment) + driving_text(moment) + events_text(begin, moment);
  }
  [[nodiscard]] Json json(Stamp moment) const {
    Json json = {{"inputs", inputs_json(moment)},
                 {"measurements", measurements_json(moment)},
                 {"registrations", registrations_json(moment)},
                 {"belief", belief_json(moment)},
                 {"integrity", integrity_json(moment)},
                 {"bg", driving_json(moment)},
                 {"events", Json::array()}};
    for (const Received<event_t>& e : events_) {
      if (moment - e.arrival > kEvents) continue;
      json["events"].push_back({{"age_s", age_s(moment, e.arrival)},
                                {"node", evaluation::printable(e.message.node)},
                                {"code", evaluation::printable(e.message.code)},
                                {"text", evaluation::printable(e.message.text)}});
    }
    return json;
  }
  [[nodiscard]] Stamp now() const { return now_; }

 private:
  struct Input {
    std::deque<Stamp> recent;
  };

  template <class T>
  static void with(const LogEvent& event, std::deque<Received<T>>* kept, std::size_t most) {
    Received<T> received{event.stamp, {}};
    const int size = static_cast<int>(event.data.size());
    if (received.message.decode(event.data.data(), 0, size) != size) return;
    kept->push_back(std::move(received));
    if (kept->size() > most) kept->pop_front();
  }

  [[nodiscard]] static double age_s(Stamp moment, Stamp arrival) {
    return seconds(moment - arrival);
  }

  [[nodiscard]] Json inputs_json(Stamp moment) const {
    Json json = Json::array();
    for (const auto& [name, input] : inputs_) {
      const auto recent = std::count_if(input.recent.begin(), input.recent.end(),
                                        [&](Stamp s) { return moment - s <= kRecent; });
      json.push_back({{"channel", name},
                      {"age_s", age_s(moment, input.recent.back())},
                      {"in_last_second", recent}});
    }
    return json;
  }

  /// Of the last second.
  [[nodiscard]] Json measurements_json(Stamp moment) const {
    Json json = Json::array();
    for (const Received<innovation_t>& i : innovations_) {
      if (moment - i.arrival > kRecent) continue;
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

  [[nodiscard]] Json registrations_json(Stamp moment) const {
    Json json = Json::array();
    for (const Received<registration_t>& r : registrations_) {
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

  [[nodiscard]] Json belief_json(Stamp moment) const {
    if (nav_.empty()) return nullptr;
    const nav_state_t& m = nav_.back().message;
    const Mat6 cov = from_message(m.cov_world_pose);
    const auto sigma = [&cov](int i) { return std::sqrt(std::max(0.0, cov(i, i))); };
    const auto age = [](std::int64_t us) { return us < 0 ? Json() : Json(seconds(Duration(us))); };
    return {{"age_s", age_s(moment, nav_.back().arrival)},
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

  [[nodiscard]] Json integrity_json(Stamp moment) const {
    if (integrity_.empty()) return nullptr;
    const integrity_t& m = integrity_.back().message;
    const auto source = [&m](int status, std::int64_t since, double ratio) {
      return Json{{"status", source_status_name(status)},
                  {"for_s", seconds(Duration(m.utime - since))},
                  {"test_ratio", ratio}};
    };
    return {{"age_s", age_s(moment, integrity_.back().arrival)},
            {"protection_horizontal_m", m.protection_horizontal_m},
            {"protection_vertical_m", m.protection_vertical_m},
            {"limit_horizontal_m", m.limit_horizontal_m},
            {"limit_vertical_m", m.limit_vertical_m},
            {"alerts", alert_names(m.alerts)},
            {"gps", source(m.gps, m.gps_since_utime, m.gps_test_ratio)},
            {"ladar", source(m.ladar, m.ladar_since_utime, m.ladar_test_ratio)}};
  }

  [[nodiscard]] Json driving_json(Stamp moment) const {
    Json json = {{"status", nullptr}, {"drive", nullptr}, {"plan", nullptr}};
    if (!status_.empty()) {
      const status_t& m = status_.back().message;
      json["status"] = {{"age_s", age_s(moment, status_.back().arrival)},
                        {"state", m.state},
                        {"reason", m.reason}};
    }
    if (!drive_.empty()) {
      const drive_t& m = drive_.back().message;
      json["drive"] = {{"age_s", age_s(moment, drive_.back().arrival)},
                       {"speed_mps", m.speed_mps},
                       {"curvature_1pm", m.curvature_1pm},
                       {"brake", m.brake != 0}};
    }
    if (!plan_.empty()) {
      const plan_t& m = plan_.back().message;
      json["plan"] = {{"age_s", age_s(moment, plan_.back().arrival)},
                      {"points", m.n},
                      {"cost", m.cost},
                      {"issuer", m.issuer},
                      {"serial", m.serial}};
    }
    return json;
  }

  [[nodiscard]] std::string inputs_text(Stamp moment) const {
    report::Table t{{"received", "last", "in the last second"}, {}};
    for (const auto& [name, input] : inputs_) {
      const auto recent = std::count_if(input.recent.begin(), input.recent.end(),
                                        [&](Stamp s) { return moment - s <= kRecent; });
      t.rows.push_back({name, ago(moment - input.recent.back()), std::to_string(recent)});
    }
    return to_text(t) + "\n";
  }

  [[nodiscard]] std::string considered_text(Stamp moment) const {
    struct Sum {
      int considered = 0;
      int accepted = 0;
      double worst = 0.0;
    };
    std::map<int, Sum> sums;
    report::Table refused{{"rejected", "", "reason", "NIS", "gate"}, {}};
    for (const Received<innovation_t>& i : innovations_) {
      if (moment - i.arrival > kRecent) continue;
      const innovation_t& m = i.message;
      Sum& sum = sums[m.source];
      ++sum.considered;
      sum.accepted += m.accepted != 0 ? 1 : 0;
      if (m.accepted != 0 && m.gate > 0.0) sum.worst = std::max(sum.worst, m.nis / m.gate);
      if (m.accepted != 0) continue;
      refused.rows.push_back({std::string(innovation_source_name(m.source)),
                              ago(moment - i.arrival),
                              std::string(innovation_reason_name(m.reason)),
                              m.gate > 0.0 ? fmt::format("{:.1f}", m.nis) : "-",
                              m.gate > 0.0 ? fmt::format("{:.1f}", m.gate) : "-"});
    }
    report::Table t{{"measurements in WM, last second", "accepted", "of", "max NIS/gate accepted"},
                    {}};
    for (const auto& [source, sum] : sums) {
      t.rows.push_back({std::string(innovation_source_name(source)), std::to_string(sum.accepted),
                        std::to_string(sum.considered), fmt::format("{:.2f}", sum.worst)});
    }
    if (t.rows.empty()) return "WM processed no measurement in the last second.\n\n";
    std::string text = to_text(t);
    if (refused.rows.size() > kRefusals) {
      refused.rows.erase(refused.rows.begin(),
                         refused.rows.end() - static_cast<std::ptrdiff_t>(kRefusals));
    }
    if (!refused.rows.empty()) text += "\n" + to_text(refused);
    return text + "\n";
  }

  [[nodiscard]] std::string registrations_text(Stamp moment) const {
    report::Table t{{"registrations", "", "stop", "points", "pairs", "overlap", "moved [m]",
                     "turned [deg]", "used / granted", "level"},
                    {}};
    for (const Received<registration_t>& r : registrations_) {
      const registration_t& m = r.message;
      t.rows.push_back(
          {fmt::format("{}, {}", m.scan_id,
                       m.target == registration_t::TARGET_ROLLING ? "rolling" : "a priori"),
           ago(moment - r.arrival), std::string(recording::stop_name(m.stop)),
           std::to_string(m.points), std::to_string(m.pairs),
           fmt::format("{:.0f} %", 100.0 * m.overlap), fmt::format("{:.2f}", m.correction_m),
           fmt::format("{:.2f}", degrees(m.correction_rad)),
           fmt::format("{} / {}", m.used_units, m.granted_units), std::to_string(m.degrade_level)});
    }
    t.note =
        "scan and map; moved, turned: correction of the prediction; used / granted: work units; "
        "level: degrade level";
    return t.rows.empty() ? "SP has published no registration.\n\n" : to_text(t) + "\n";
  }

  [[nodiscard]] std::string belief_text(Stamp moment) const {
    if (nav_.empty()) return "WM has published nothing.\n\n";
    const nav_state_t& m = nav_.back().message;
    const Mat6 cov = from_message(m.cov_world_pose);
    const auto age = [](std::int64_t us) {
      return us < 0 ? std::string("never") : ago(Duration(us));
    };
    std::string text = fmt::format(
        "belief of WM ({}): {}{}\n"
        "  sigma {:.2f} {:.2f} {:.2f} m (vehicle x y z), yaw {:.2f} deg\n"
        "  last accepted: INS {}, GPS {}, odometry {},\n    rolling map {}, a priori map {}; "
        "{:.0f} m "
        "since GPS; {} resets\n",
        ago(moment - nav_.back().arrival), nav_mode_name(m.mode),
        m.world_valid != 0 ? "" : ", frame world unknown", std::sqrt(std::max(0.0, cov(0, 0))),
        std::sqrt(std::max(0.0, cov(1, 1))), std::sqrt(std::max(0.0, cov(2, 2))),
        degrees(std::sqrt(std::max(0.0, cov(5, 5)))), age(m.age_ins_us), age(m.age_gps_us),
        age(m.age_odometry_us), age(m.age_rolling_us), age(m.age_prior_map_us),
        m.distance_since_gps_m, m.world_resets);
    if (m.latency_trace.last_facet_utime != 0) {
      text += fmt::format(
          "  newest scan: last facet in SP {}, start of SP {:.1f} ms later, result in WM {:.1f} ms "
          "after that\n",
          // Each difference is within one clock: that of the log, and that of the nodes.
          ago(moment - nav_.back().arrival +
              Duration(m.publish_utime - m.latency_trace.last_facet_utime)),
          milliseconds(Duration(m.latency_trace.sp_start_utime - m.latency_trace.last_facet_utime)),
          milliseconds(
              Duration(m.latency_trace.wm_arrival_utime - m.latency_trace.sp_start_utime)));
    }
    if (integrity_.empty()) return text + "  no protection level published\n\n";
    const integrity_t& i = integrity_.back().message;
    const auto level = [](double level_m) {
      return std::isfinite(level_m) ? fmt::format("{:.2f} m", level_m) : std::string("unbounded");
    };
    return text +
           fmt::format(
               "  protection level {} horizontal, {} vertical (limits {:.1f} and {:.1f} m); "
               "alerts: {}\n"
               "  GPS {} for {:.1f} s (test ratio {:.2f}), LADAR {} for {:.1f} s (test ratio "
               "{:.2f});\n    limit of the test ratio: 1\n\n",
               level(i.protection_horizontal_m), level(i.protection_vertical_m),
               i.limit_horizontal_m, i.limit_vertical_m, alert_names(i.alerts),
               source_status_name(i.gps), seconds(Duration(i.utime - i.gps_since_utime)),
               i.gps_test_ratio, source_status_name(i.ladar),
               seconds(Duration(i.utime - i.ladar_since_utime)), i.ladar_test_ratio);
  }

  [[nodiscard]] std::string driving_text(Stamp moment) const {
    std::string text;
    if (!status_.empty()) {
      const status_t& m = status_.back().message;
      text += fmt::format("BG ({}): {}{}{}\n", ago(moment - status_.back().arrival), m.state,
                          m.reason.empty() ? "" : ": ", m.reason);
    }
    if (!drive_.empty()) {
      const drive_t& m = drive_.back().message;
      text += fmt::format("  drive command ({}): {:.1f} m/s, curvature {:.3f} 1/m{}\n",
                          ago(moment - drive_.back().arrival), m.speed_mps, m.curvature_1pm,
                          m.brake != 0 ? ", brake" : "");
    }
    if (!plan_.empty()) {
      const plan_t& m = plan_.back().message;
      text += fmt::format("  plan ({}): {} points, cost {:.1f}, for {} {}\n",
                          ago(moment - plan_.back().arrival), m.n, m.cost, m.issuer, m.serial);
    }
    return text.empty() ? text : text + "\n";
  }

  [[nodiscard]] std::string events_text(Stamp begin, Stamp moment) const {
    std::string text;
    for (const Received<event_t>& e : events_) {
      if (moment - e.arrival > kEvents) continue;
      const std::string line =
          fmt::format("{} UTC {:.1f} s ({}) {}: {}: {}", time_of_day(to_utime(e.arrival)),
                      seconds(e.arrival - begin), ago(moment - e.arrival),
                      evaluation::printable(e.message.node), evaluation::printable(e.message.code),
                      evaluation::printable(e.message.text));
      text += report::wrapped(line, 4) + "\n";
    }
    if (text.empty()) return "No events in the last 30 s.\n";
    return "events of the last 30 s: time of day, seconds of the log\n" + text;
  }

  Stamp now_ = Stamp::min();
  std::map<std::string, Input> inputs_;
  std::deque<Received<innovation_t>> innovations_;
  std::deque<Received<registration_t>> registrations_;
  std::deque<Received<nav_state_t>> nav_;
  std::deque<Received<integrity_t>> integrity_;
  std::deque<Received<drive_t>> drive_;
  std::deque<Received<plan_t>> plan_;
  std::deque<Received<status_t>> status_;
  std::deque<Received<event_t>> events_;
};

}  // namespace

Result<Explanation> explain(LogReader* log, Duration after,
                            const std::function<bool(double)>& progress) {
  History history;
  LogEvent event;
  std::optional<Stamp> begin;
  while (log->next(&event)) {
    if (!begin) begin = event.stamp;
    if (!progress(static_cast<double>(log->position_bytes()) /
                  static_cast<double>(log->size_bytes()))) {
      return Error{"interrupted"};
    }
    const Stamp moment = *begin + after;
    if (event.stamp > moment) {
      Json json = {
          {"log", log->path()}, {"time_s", seconds(after)}, {"log_utime", to_utime(moment)}};
      json.update(history.json(moment));
      return Explanation{
          fmt::format("{}, {:.3f} s after its begin: {} {} UTC\n\n", log->path(), seconds(after),
                      utc_date(to_utime(moment)), time_of_day(to_utime(moment))) +
              history.text(*begin, moment),
          std::move(json)};
    }
    history.add(event);
  }
  if (!begin) return Error{log->path() + ": the log is empty"};
  return Error{
      fmt::format("{}: the log ends after {:.1f} s", log->path(), seconds(history.now() - *begin))};
}

}  // namespace rcs::studies

#include "tools/studies/explanation_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>

#include "lcmtypes/convert.h"
#include "lcmtypes/message_names.h"
#include "rcs/base/printable.h"
#include "rcs/base/text.h"
#include "rcs/node/time_text.h"
#include "tools/evaluation/top_model.h"
#include "tools/recording/run_log.h"
#include "tools/report/table.h"

namespace rcs::studies {
namespace {

constexpr std::size_t kRejectedShown = 12;

std::string ago(Duration d) {
  const double s = seconds(d);
  return s < 1.0 ? fmt::format("{:.0f} ms ago", 1e3 * s) : fmt::format("{:.1f} s ago", s);
}

std::string inputs_text(const MessageHistory& history, Stamp moment) {
  report::Table t{{"received", "last", "in the last second"}, {}};
  for (const auto& [name, arrivals] : history.inputs) {
    const auto recent = std::count_if(arrivals.begin(), arrivals.end(), [&](Stamp s) {
      return moment - s <= MessageHistory::kRecent;
    });
    t.rows.push_back({name, ago(moment - arrivals.back()), std::to_string(recent)});
  }
  return to_text(t) + "\n";
}

std::string considered_text(const MessageHistory& history, Stamp moment) {
  struct Sum {
    int considered = 0;
    int accepted = 0;
    double worst = 0.0;
  };
  std::map<int, Sum> sums;
  report::Table rejected{{"rejected", "", "reason", "NIS", "gate"}, {}};
  for (const Received<innovation_t>& i : history.innovations) {
    if (moment - i.arrival > MessageHistory::kRecent) continue;
    const innovation_t& m = i.message;
    Sum& sum = sums[m.source];
    ++sum.considered;
    sum.accepted += m.accepted != 0 ? 1 : 0;
    if (m.accepted != 0 && m.gate > 0.0) sum.worst = std::max(sum.worst, m.nis / m.gate);
    if (m.accepted != 0) continue;
    rejected.rows.push_back({std::string(innovation_source_name(m.source)), ago(moment - i.arrival),
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
  if (rejected.rows.size() > kRejectedShown) {
    rejected.rows.erase(rejected.rows.begin(),
                        rejected.rows.end() - static_cast<std::ptrdiff_t>(kRejectedShown));
  }
  if (!rejected.rows.empty()) text += "\n" + to_text(rejected);
  return text + "\n";
}

std::string registrations_text(const MessageHistory& history, Stamp moment) {
  report::Table t{{"registrations", "", "stop", "points", "pairs", "overlap", "moved [m]",
                   "turned [deg]", "used / granted", "level"},
                  {}};
  for (const Received<registration_t>& r : history.registrations) {
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

std::string belief_text(const MessageHistory& history, Stamp moment) {
  if (history.nav.empty()) return "WM has published nothing.\n\n";
  const nav_state_t& m = history.nav.back().message;
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
      ago(moment - history.nav.back().arrival), nav_mode_name(m.mode),
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
        ago(moment - history.nav.back().arrival +
            Duration(m.publish_utime - m.latency_trace.last_facet_utime)),
        milliseconds(Duration(m.latency_trace.sp_start_utime - m.latency_trace.last_facet_utime)),
        milliseconds(Duration(m.latency_trace.wm_arrival_utime - m.latency_trace.sp_start_utime)));
  }
  if (history.integrity.empty()) return text + "  no protection level published\n\n";
  const integrity_t& i = history.integrity.back().message;
  const auto level = [](double level_m) {
    return std::isfinite(level_m) ? fmt::format("{:.2f} m", level_m) : std::string("unbounded");
  };
  return text +
         fmt::format(
             "  protection level {} horizontal, {} vertical (limits {:.1f} and {:.1f} m); "
             "alerts: {}\n"
             "  INS {} for {:.1f} s, GPS {} for {:.1f} s (test ratio {:.2f}),\n  LADAR {} for "
             "{:.1f} s (test ratio {:.2f}); limit of the test ratio: 1\n\n",
             level(i.protection_horizontal_m), level(i.protection_vertical_m), i.limit_horizontal_m,
             i.limit_vertical_m, alert_names(i.alerts), source_status_name(i.ins),
             seconds(Duration(i.utime - i.ins_since_utime)), source_status_name(i.gps),
             seconds(Duration(i.utime - i.gps_since_utime)), i.gps_test_ratio,
             source_status_name(i.ladar), seconds(Duration(i.utime - i.ladar_since_utime)),
             i.ladar_test_ratio);
}

std::string driving_text(const MessageHistory& history, Stamp moment) {
  std::string text;
  if (!history.status.empty()) {
    const status_t& m = history.status.back().message;
    text += fmt::format("BG ({}): {}{}{}\n", ago(moment - history.status.back().arrival),
                        printable_line(m.state), m.reason.empty() ? "" : ": ",
                        printable_line(m.reason));
  }
  if (!history.drive.empty()) {
    const drive_t& m = history.drive.back().message;
    text += fmt::format("  drive command ({}): {:.1f} m/s, curvature {:.3f} 1/m{}\n",
                        ago(moment - history.drive.back().arrival), m.speed_mps, m.curvature_1pm,
                        m.brake != 0 ? ", brake" : "");
  }
  if (!history.plan.empty()) {
    const plan_t& m = history.plan.back().message;
    text += fmt::format("  plan ({}): {} points, cost {:.1f}, for {} {}\n",
                        ago(moment - history.plan.back().arrival), m.n, m.cost,
                        printable_line(m.issuer), m.serial);
  }
  return text.empty() ? text : text + "\n";
}

std::string mission_text(const MessageHistory& history, Stamp moment) {
  std::string text;
  if (!history.mission_status.empty()) {
    const status_t& m = history.mission_status.back().message;
    text += fmt::format(
        "mission ({}): {}{}{}\n", ago(moment - history.mission_status.back().arrival),
        printable_line(m.state), m.reason.empty() ? "" : ": ", printable_line(m.reason));
  }
  if (!history.routes.empty()) {
    const routes_t& m = history.routes.back().message;
    report::Table t{{"route", "weight", "length [m]", "time [s]", "level [m]", "risk", "cost [s]"},
                    {}};
    for (const route_t& r : m.route) {
      t.rows.push_back({std::string(route_verdict_name(r.verdict)),
                        report::fixed(r.poverty_weight, 0), report::fixed(r.length_m, 0),
                        report::fixed(r.time_s, 0), report::fixed(r.level_max_m, 1),
                        report::fixed(r.risk, 3), report::fixed(r.cost_s, 0)});
    }
    t.note = fmt::format(
        "judged {}, with{} GPS, alert limit {:.1f} m. weight: of ground without features in the "
        "search. level: largest protection level if GPS fails. risk: of an error above the limit "
        "then. cost: time and risk",
        ago(moment - history.routes.back().arrival), m.gps != 0 ? "" : "out", m.alert_limit_m);
    text += m.route.empty() ? "  no route exists\n" : to_text(t);
  }
  return text.empty() ? text : text + "\n";
}

std::string events_text(const MessageHistory& history, Stamp begin, Stamp moment) {
  std::string text;
  for (const Received<event_t>& e : history.events) {
    if (moment - e.arrival > MessageHistory::kEvents) continue;
    const std::string line = fmt::format(
        "{} UTC {:.1f} s ({}) {}: {}: {}", time_of_day(to_utime(e.arrival)),
        seconds(e.arrival - begin), ago(moment - e.arrival), evaluation::printable(e.message.node),
        evaluation::printable(e.message.code), evaluation::printable(e.message.text));
    text += wrapped(line, 4) + "\n";
  }
  if (text.empty()) return "No events in the last 30 s.\n";
  return "events of the last 30 s: time of day, seconds of the log\n" + text;
}

}  // namespace

std::string route_reason(const route_t& route, const routes_t& choice) {
  const auto chosen = std::find_if(choice.route.begin(), choice.route.end(), [](const route_t& r) {
    return r.verdict == route_t::VERDICT_CHOSEN;
  });
  const bool above = !(route.level_max_m <= choice.alert_limit_m);
  const std::string level =
      std::isfinite(route.level_max_m)
          ? fmt::format("level above the limit of {:.1f} m", choice.alert_limit_m)
          : std::string("WM predicted no level");
  const std::string dearer =
      chosen == choice.route.end()
          ? std::string("not chosen")
          : fmt::format("{:.0f} s dearer than the chosen one", route.cost_s - chosen->cost_s);
  switch (route.verdict) {
    case route_t::VERDICT_CHOSEN:
      return above ? "lowest cost; " + level + ", possible with GPS" : "lowest cost";
    case route_t::VERDICT_DEARER:
      return dearer;
    case route_t::VERDICT_ABOVE_LIMIT:
      return level + (choice.gps != 0 ? "; " + dearer : std::string(": impossible without GPS"));
    default:
      return "not judged";
  }
}

std::string route_choice_text(const routes_t& choice) {
  std::string text = fmt::format("with{} GPS, alert limit {:.1f} m, for the task of {}\n",
                                 choice.gps != 0 ? "" : "out", choice.alert_limit_m,
                                 printable_line(choice.issuer));
  if (choice.route.empty()) return text + "no route exists\n";
  report::Table t{
      {"route", "weight", "length [m]", "time [s]", "level [m]", "risk", "cost [s]", "reason"}, {}};
  for (const route_t& r : choice.route) {
    t.rows.push_back(
        {std::string(route_verdict_name(r.verdict)), report::fixed(r.poverty_weight, 0),
         report::fixed(r.length_m, 0), report::fixed(r.time_s, 0), report::fixed(r.level_max_m, 1),
         report::fixed(r.risk, 3), report::fixed(r.cost_s, 0), route_reason(r, choice)});
  }
  return text + to_text(t);
}

std::string explanation_text(const MessageHistory& history, Stamp begin, Stamp moment) {
  return inputs_text(history, moment) + considered_text(history, moment) +
         registrations_text(history, moment) + belief_text(history, moment) +
         mission_text(history, moment) + driving_text(history, moment) +
         events_text(history, begin, moment);
}

}  // namespace rcs::studies

#include "tools/rcs/logs/driving_section.h"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "lcmtypes/message_names.h"
#include "rcs/base/result.h"
#include "tools/evaluation/driving_plot.h"
#include "tools/report/table.h"

namespace rcs::cli {
namespace {

/// Every choice of the mission, a row for each candidate.
report::Table route_table(const std::vector<routes_t>& choices) {
  report::Table t{{"choice", "GPS", "candidate", "length [m]", "time [s]", "level [m]", "cost [s]"},
                  {}};
  const auto first_utime = choices.empty() ? 0 : choices.front().utime;
  for (const routes_t& choice : choices) {
    for (const route_t& r : choice.route) {
      const bool first = &r == &choice.route.front();
      t.rows.push_back(
          {first ? fmt::format("{:.0f} s", 1e-6 * static_cast<double>(choice.utime - first_utime))
                 : "",
           first ? (choice.gps != 0 ? "received" : "lost") : "",
           std::string(route_verdict_name(r.verdict)), report::fixed(r.length_m, 0),
           report::fixed(r.time_s, 0),
           std::isfinite(r.level_max_m)
               ? fmt::format("{:.1f} of {:.1f}", r.level_max_m, choice.alert_limit_m)
               : "not predicted",
           report::fixed(r.cost_s, 0)});
    }
  }
  t.note =
      "choice: time since the first one; routes are chosen again when GPS is lost, or when BG "
      "finds no path. level: largest horizontal protection level that WM predicts along the route "
      "if GPS fails at its start, and the alert limit of the task: without GPS the vehicle drives "
      "no route above it, as it would have to stop there. cost: time, and the risk of that.";
  return t;
}

}  // namespace

void add_driving(const std::string& log, report::HtmlPage* page) {
  const Result<std::optional<evaluation::DrivingRecord>> record = evaluation::driving_record(log);
  if (!record || !*record) return;
  page->heading("Driving");
  page->paragraph(
      "Cells: obstacles in the last map of WM that contained them, by the height of their step; an "
      "edge that hides ground has none. Numbers: places of the task, or waypoints of the longest "
      "command. Circles: horizontal protection level, every 15 m of the course; levels above 100 m "
      "are not drawn. Frame local drifts against frame world: places are drawn by the last pose, "
      "routes by that of their choice.");
  page->plot((*record)->plot);
  if ((*record)->choices.empty()) return;
  page->heading("Routes of the mission");
  page->table(route_table((*record)->choices));
}

}  // namespace rcs::cli

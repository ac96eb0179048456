#include "tools/driving/drive_output.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tools/evaluation/route_json.h"

namespace rcs::driving {
namespace {

using report::Json;

struct Sums {
  int arrived = 0;
  int contacts = 0;
  int waypoints = 0;
  int reached = 0;
  double distance_m = 0.0;
  double time_s = 0.0;
  std::map<std::string, double> speed_limited_s;
  int actors_met = 0;
  int actor_contacts = 0;
  int ran_into_vehicle = 0;
  ActorGround ground;

  [[nodiscard]] double mean_mps() const { return time_s > 0.0 ? distance_m / time_s : 0.0; }
};

Sums sums_of(const std::vector<DriveRow>& rows) {
  Sums out;
  for (const auto& [seed, run] : rows) {
    out.arrived += run.done ? 1 : 0;
    out.contacts += contacts(run);
    out.waypoints += static_cast<int>(run.waypoints_world.size());
    out.reached += run.reached;
    out.distance_m += run.distance_m;
    out.time_s += run.time_s;
    for (const auto& [limit, time_s] : run.speed_limited_s) out.speed_limited_s[limit] += time_s;
    out.actors_met += run.actors.met();
    out.actor_contacts += run.actors.contacts_of_vehicle();
    out.ran_into_vehicle += run.actors.ran_into_vehicle();
    const ActorGround& ground = run.actors.ground;
    out.ground.remaining += ground.remaining;
    out.ground.free_after_s.insert(out.ground.free_after_s.end(), ground.free_after_s.begin(),
                                   ground.free_after_s.end());
  }
  std::sort(out.ground.free_after_s.begin(), out.ground.free_after_s.end());
  return out;
}

/// Share of the time within the protection level; 1 where there is none.
double share_within(const ClosedLoopRun& run) {
  return run.bounded_s > 0.0 ? 1.0 - run.outside_level_s / run.bounded_s : 1.0;
}

/// States in which the vehicle was longest, but for those in which it moves.
std::string held_up(const ClosedLoopRun& run) {
  std::vector<std::pair<double, std::string>> by_time;
  for (const auto& [state, time_s] : run.states_s) {
    const bool moves = state == "DRIVING" || state == "DRIVING_NO_GPS" || state == "ARRIVED" ||
                       state == "INITIALIZING_HEADING";
    if (!moves && state != "IDLE" && time_s >= 0.5) by_time.emplace_back(time_s, state);
  }
  std::sort(by_time.rbegin(), by_time.rend());
  std::string text;
  for (std::size_t k = 0; k < std::min<std::size_t>(2, by_time.size()); ++k) {
    text += fmt::format("{}{} {:.0f} s", k == 0 ? "" : ", ", by_time[k].second, by_time[k].first);
  }
  return text;
}

/// Shares of the time, largest first.
std::string shares(const std::map<std::string, double>& times_s) {
  std::vector<std::pair<double, std::string>> by_time;
  double sum_s = 0.0;
  for (const auto& [name, time_s] : times_s) {
    by_time.emplace_back(time_s, name);
    sum_s += time_s;
  }
  std::sort(by_time.rbegin(), by_time.rend());
  std::string text;
  for (const auto& [time_s, name] : by_time) {
    if (time_s < 0.01 * sum_s) break;
    text += fmt::format("{}{} {:.0f} %", text.empty() ? "" : ", ", name, 100.0 * time_s / sum_s);
  }
  return text;
}

bool has_actors(const std::vector<DriveRow>& rows) {
  return std::any_of(rows.begin(), rows.end(),
                     [](const DriveRow& row) { return !row.run.actors.actors.empty(); });
}

bool has_alerts(const std::vector<DriveRow>& rows) {
  return std::any_of(rows.begin(), rows.end(), [](const DriveRow& row) {
    return row.run.alerts.crossings > 0 || !row.run.losses.empty();
  });
}

double percentile_95(const std::vector<double>& sorted) {
  return sorted.empty() ? 0.0 : sorted[(sorted.size() - 1) * 95 / 100];
}

Json to_json(const AlertOutcome& alerts) {
  return {{"crossings", alerts.crossings}, {"late", alerts.late},
          {"beyond_m", alerts.beyond_m},   {"beyond_s", alerts.beyond_s},
          {"slowed_s", alerts.slowed_s},   {"too_fast_s", alerts.too_fast_s}};
}

Json to_json(const ZoneOutcome& zones) {
  Json out = {{"judged", zones.judged}, {"entries", zones.entries}};
  if (zones.judged) out["clearance_m"] = zones.min_clearance_m;
  return out;
}

Json to_json(const std::vector<SourceLoss>& losses) {
  Json out = Json::array();
  for (const SourceLoss& loss : losses) {
    out.push_back({{"source", loss.source}, {"begin_s", loss.begin_s}, {"end_s", loss.end_s}});
  }
  return out;
}

Json to_json(const ActorGround& ground) {
  return {{"cells", ground.free_after_s.size()},
          {"late", ground.late()},
          {"remaining", ground.remaining},
          {"free_after_p95_s", percentile_95(ground.free_after_s)},
          {"free_after_max_s", ground.worst_s()}};
}

Json to_json(const ActorOutcome& outcome) {
  Json contacts = Json::array();
  for (const sim::ActorContact& c : outcome.contacts) {
    contacts.push_back({{"time_s", c.time_s},
                        {"actor", c.actor},
                        {"speed_mps", c.speed_mps},
                        {"bearing_deg", degrees(c.bearing_rad)},
                        {"ran_into_vehicle", c.ran_into_vehicle}});
  }
  Json actors = Json::array();
  for (const ActorRecord& a : outcome.actors) {
    actors.push_back({{"kind", a.kind == sim::ActorKind::kPerson ? "person" : "vehicle"},
                      {"start_s", a.start_s},
                      {"nearest_m", a.nearest_m}});
  }
  return {{"met", outcome.met()},
          {"list", actors},
          {"contacts", contacts},
          {"ground", to_json(outcome.ground)}};
}

/// Every choice of the mission node.
Json to_json(const std::vector<routes_t>& choices) {
  Json out = Json::array();
  for (const routes_t& choice : choices) {
    out.push_back(evaluation::route_choice_json(choice));
    out.back()["utime"] = choice.utime;
  }
  return out;
}

bool has_way_back(const std::vector<DriveRow>& rows) {
  return std::any_of(rows.begin(), rows.end(),
                     [](const DriveRow& row) { return row.run.way_back.length_m > 0.0; });
}

bool has_predictions(const std::vector<DriveRow>& rows) {
  return std::any_of(rows.begin(), rows.end(),
                     [](const DriveRow& row) { return !row.run.predictions.ratios.empty(); });
}

double median(const std::vector<double>& sorted) {
  return sorted.empty() ? 0.0 : sorted[sorted.size() / 2];
}

Json to_json(const PredictionOutcome& p) {
  Json out = {{"samples", p.ratios.size()},
              {"stated_max_m", p.stated_max_m},
              {"predicted_max_m", p.predicted_max_m}};
  if (p.ratios.empty()) return out;
  out["ratio_min"] = p.ratios.front();
  out["ratio_median"] = median(p.ratios);
  out["ratio_max"] = p.ratios.back();
  out["within_factor_2"] = share_predicted(p.ratios);
  return out;
}

bool has_zones(const std::vector<DriveRow>& rows) {
  return std::any_of(rows.begin(), rows.end(),
                     [](const DriveRow& row) { return row.run.zones.judged; });
}

}  // namespace

report::Table drive_table(const std::vector<DriveRow>& rows) {
  report::Table t{{"seed", "arrived", "waypoints", "contacts", "clear [m]", "tilt [deg]",
                   "time [s]", "mean [m/s]", "error [m]", "within", "held up"},
                  {}};
  const bool actors = has_actors(rows);
  if (actors) {
    const std::vector<std::string> more = {"actors", "hit", "ran into", "free [s]"};
    t.header.insert(t.header.end() - 1, more.begin(), more.end());
  }
  const bool back = has_way_back(rows);
  if (back) {
    const std::vector<std::string> more = {"back [m]", "lateral [m]", "max [m]", "end [m]"};
    t.header.insert(t.header.end() - 1, more.begin(), more.end());
  }
  const bool predicted = has_predictions(rows);
  if (predicted) {
    const std::vector<std::string> more = {"ratio", "within x2"};
    t.header.insert(t.header.end() - 1, more.begin(), more.end());
  }
  const bool zones = has_zones(rows);
  if (zones) {
    const std::vector<std::string> more = {"entered", "zone [m]"};
    t.header.insert(t.header.end() - 1, more.begin(), more.end());
  }
  const bool alerts = has_alerts(rows);
  if (alerts) {
    const std::vector<std::string> more = {"limits", "late", "beyond [m]", "slow [s]", "fast [s]"};
    t.header.insert(t.header.end() - 1, more.begin(), more.end());
  }
  for (const auto& [seed, run] : rows) {
    t.rows.push_back({std::to_string(seed), run.done ? "yes" : "NO",
                      fmt::format("{}/{}", run.reached, run.waypoints_world.size()),
                      std::to_string(contacts(run)), report::fixed(run.min_clearance_m, 2),
                      report::fixed(degrees(run.worst_tilt_rad), 0), report::fixed(run.time_s, 0),
                      report::fixed(run.mean_mps, 1), report::fixed(run.worst_error_m, 2),
                      report::fixed(share_within(run), 4), held_up(run)});
    const auto add = [&row = t.rows.back()](const std::vector<std::string>& more) {
      row.insert(row.end() - 1, more.begin(), more.end());
    };
    const ActorOutcome& a = run.actors;
    if (actors) {
      add({std::to_string(a.met()), std::to_string(a.contacts_of_vehicle()),
           std::to_string(a.ran_into_vehicle()), report::fixed(a.ground.worst_s(), 1)});
    }
    if (back) {
      const WayBackOutcome& w = run.way_back;
      add({report::fixed(w.length_m, 0), report::fixed(w.lateral_rms_m, 2),
           report::fixed(w.lateral_max_m, 2), report::fixed(w.end_m, 2)});
    }
    if (predicted) {
      add({report::fixed(median(run.predictions.ratios), 2),
           report::fixed(share_predicted(run.predictions.ratios), 3)});
    }
    if (zones) {
      add({std::to_string(run.zones.entries), report::fixed(run.zones.min_clearance_m, 1)});
    }
    if (alerts) {
      const AlertOutcome& o = run.alerts;
      add({std::to_string(o.crossings), std::to_string(o.late), report::fixed(o.beyond_m, 1),
           report::fixed(o.slowed_s, 0), report::fixed(o.too_fast_s, 1)});
    }
  }
  t.note =
      "contacts: wheel at an edge, ground against the body, tilted beyond the limit, rock, trunk "
      "or moving actor. "
      "clear: smallest distance to a rock or trunk. tilt, error: largest. within: share of the "
      "time with the error within the horizontal protection level. held up: states other than "
      "driving.";
  if (actors) {
    t.note +=
        " actors: that moved within 30 m of the vehicle. hit: contacts with them, part of "
        "contacts. "
        "ran into: actors that ran into the vehicle, which had been at rest for a second; no part "
        "of contacts. free: longest time that ground where an actor was stayed an obstacle in WM's "
        "map, in view of the LADAR.";
  }
  if (back) {
    t.note +=
        " back: length of the way back. lateral, max: RMS and largest distance of the true way "
        "back from the true way out, once the vehicle has turned round and is on it. end: distance "
        "of its end from the start.";
  }
  if (predicted) {
    t.note +=
        " ratio: standard deviation of the position that WM states on a route chosen without GPS, "
        "over the one that was predicted for it, median; within x2: share of the time with a ratio "
        "from 0.5 to 2.";
  }
  if (zones) {
    t.note +=
        " entered: times that the true outline was in forbidden ground. zone: its smallest "
        "distance "
        "to it.";
  }
  if (alerts) {
    t.note +=
        " limits: alert limits that a protection level exceeded while the vehicle moved. late: of "
        "these, with more way than it needs to stop. beyond: longest such way. slow: time between "
        "half of a limit and the limit. fast: with a drive command above the share of the speed "
        "that the levels allow.";
  }
  return t;
}

std::string drive_summary(const std::vector<DriveRow>& rows) {
  const Sums s = sums_of(rows);
  std::string text = fmt::format(
      "arrived {} of {}, waypoints {} of {}, contacts {}, {:.1f} km, mean {:.1f} m/s\n", s.arrived,
      rows.size(), s.reached, s.waypoints, s.contacts, 1e-3 * s.distance_m, s.mean_mps());
  text += fmt::format("speed limited by: {}\n", shares(s.speed_limited_s));
  if (has_actors(rows)) {
    text += fmt::format(
        "moving actors: {} met, contacts with them {}, ran into the vehicle at rest {}; ground "
        "free "
        "again after {:.1f} s (95 %), at most {:.1f} s, {} of {} cells later than {:.0f} s\n",
        s.actors_met, s.actor_contacts, s.ran_into_vehicle, percentile_95(s.ground.free_after_s),
        s.ground.worst_s(), s.ground.late(), s.ground.free_after_s.size(), ActorGround::kLimit_s);
  }
  if (has_zones(rows)) {
    int entries = 0;
    double min_m = 1e3;
    for (const DriveRow& row : rows) {
      entries += row.run.zones.entries;
      min_m = std::min(min_m, row.run.zones.min_clearance_m);
    }
    text += fmt::format("zones: entered {} times, smallest clearance {:.1f} m\n", entries, min_m);
  }
  if (has_alerts(rows)) {
    AlertOutcome sum;
    for (const DriveRow& row : rows) {
      sum.crossings += row.run.alerts.crossings;
      sum.late += row.run.alerts.late;
      sum.slowed_s += row.run.alerts.slowed_s;
      sum.too_fast_s += row.run.alerts.too_fast_s;
    }
    text += fmt::format(
        "alert limits: exceeded {} times while moving, {} of them stopped late; slower for {:.0f} "
        "s, too fast for {:.1f} s\n",
        sum.crossings, sum.late, sum.slowed_s, sum.too_fast_s);
  }
  return text;
}

Json to_json(const std::vector<DriveRow>& rows) {
  const Sums s = sums_of(rows);
  Json out = {{"summary",
               {{"drives", rows.size()},
                {"arrived", s.arrived},
                {"waypoints", s.waypoints},
                {"reached", s.reached},
                {"contacts", s.contacts},
                {"actors",
                 {{"met", s.actors_met},
                  {"contacts", s.actor_contacts},
                  {"ran_into_vehicle", s.ran_into_vehicle},
                  {"ground", to_json(s.ground)}}},
                {"distance_m", s.distance_m},
                {"mean_mps", s.mean_mps()}}},
              {"drives", Json::array()}};
  for (const auto& [seed, run] : rows) {
    Json states = Json::object();
    for (const auto& [state, time_s] : run.states_s) states[state] = time_s;
    Json mission_states = Json::object();
    for (const auto& [state, time_s] : run.mission_states_s) mission_states[state] = time_s;
    out["drives"].push_back({{"seed", seed},
                             {"arrived", run.done},
                             {"reason", run.reason},
                             {"state", run.state},
                             {"waypoints", run.waypoints_world.size()},
                             {"reached", run.reached},
                             {"contacts",
                              {{"edge", run.contacts.edge},
                               {"body", run.contacts.body},
                               {"tipped", run.contacts.tipped},
                               {"object", run.collisions},
                               {"actor", run.actors.contacts_of_vehicle()},
                               {"actor_ran_into_vehicle", run.actors.ran_into_vehicle()}}},
                             {"actors", to_json(run.actors)},
                             {"alerts", to_json(run.alerts)},
                             {"losses", to_json(run.losses)},
                             {"foliage_contacts", run.foliage_contacts},
                             {"clearance_m", run.min_clearance_m},
                             {"tilt_deg", degrees(run.worst_tilt_rad)},
                             {"time_s", run.time_s},
                             {"distance_m", run.distance_m},
                             {"mean_mps", run.mean_mps},
                             {"fastest_mps", run.fastest_mps},
                             {"lateral_mps2", run.worst_lateral_mps2},
                             {"error_m", run.worst_error_m},
                             {"within_level", share_within(run)},
                             {"way_back",
                              {{"length_m", run.way_back.length_m},
                               {"lateral_rms_m", run.way_back.lateral_rms_m},
                               {"lateral_max_m", run.way_back.lateral_max_m},
                               {"end_m", run.way_back.end_m}}},
                             {"predictions", to_json(run.predictions)},
                             {"zones", to_json(run.zones)},
                             {"routes", to_json(run.routes)},
                             {"states_s", states},
                             {"mission_states_s", mission_states},
                             {"speed_limited_s", run.speed_limited_s}});
  }
  return out;
}

}  // namespace rcs::driving

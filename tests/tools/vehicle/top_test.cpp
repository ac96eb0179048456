#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "tools/evaluation/top_model.h"
#include "tools/rcs/vehicle/top_screen.h"

namespace rcs::cli {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr Stamp stamp_at(double s) { return Stamp(from_seconds(s)); }

process_t process(const std::string& node, double t_s) {
  process_t m{};
  m.node = node;
  m.pid = 77;
  m.start_utime = 0;
  m.cpu_us = static_cast<std::int64_t>(t_s * 0.25e6);
  m.rss_kb = 2048;
  m.realtime_priority = 60;
  m.memory_locked = 1;
  return m;
}

cycle_t cycle(const std::string& node, double t_s, std::int64_t used_us) {
  cycle_t m{};
  m.node = node;
  m.wakeup_utime = to_utime(stamp_at(t_s));
  m.deadline_utime = m.wakeup_utime + 20'000;
  m.used_wall_us = used_us;
  m.slack_us = 20'000 - used_us;
  m.n_inputs = 1;
  m.input.resize(1);
  m.input[0].channel = "INS";
  m.input[0].received = static_cast<std::int64_t>(t_s * 200.0);
  m.input[0].age_us = 5'000;
  return m;
}

/// A node with 10 units of work a second for `s` seconds; one cycle in 100 is long.
evaluation::TopModel run_for(double s) {
  evaluation::TopModel model;
  for (int i = 0; i <= static_cast<int>(10.0 * s); ++i) {
    const double t = 0.1 * i;
    if (i % 10 == 0) model.on_process(process("sp", t), stamp_at(t));
    model.on_cycle(cycle("sp", t, i % 100 == 99 ? 30'000 : 2'000 + i % 3), stamp_at(t));
  }
  return model;
}

std::string text_of(evaluation::TopModel* model, Stamp now) {
  return plain_text(top_lines(model->view(now)));
}

TEST(TopModel, RatesAndTimesCoverTheLastSeconds) {
  evaluation::TopModel model = run_for(10.0);
  const evaluation::TopView view = model.view(stamp_at(10.0));
  ASSERT_EQ(view.nodes.size(), 1U);
  const evaluation::TopView::Node& n = view.nodes[0];
  EXPECT_TRUE(n.alive);
  EXPECT_EQ(n.up, from_seconds(10.0));
  EXPECT_NEAR(*n.account_hz, 10.0, 1e-6);
  EXPECT_NEAR(*n.cpu_percent, 25.0, 1e-6);
  EXPECT_EQ(*n.used_p50, Duration(2'001));
  EXPECT_EQ(*n.used_max, Duration(30'000));
  EXPECT_EQ(*n.min_slack, Duration(-10'000));
  EXPECT_EQ(*n.budget, Duration(20'000));
  ASSERT_EQ(n.inputs.size(), 1U);
  EXPECT_NEAR(*n.inputs[0].rate_hz, 200.0, 1.0);
  EXPECT_EQ(*n.inputs[0].age, Duration(5'000));
  // After six more seconds the window is empty, and the age of the input has increased.
  const evaluation::TopView later = model.view(stamp_at(16.0));
  EXPECT_FALSE(later.nodes[0].alive);
  EXPECT_FALSE(later.nodes[0].account_hz);
  EXPECT_FALSE(later.nodes[0].used_max);
  EXPECT_EQ(*later.nodes[0].inputs[0].age, Duration(6'005'000));
}

TEST(TopModel, ARestartGivesNoNegativeLoad) {
  evaluation::TopModel model = run_for(4.0);
  process_t again = process("sp", 0.0);
  again.pid = 78;
  model.on_process(again, stamp_at(4.5));
  EXPECT_FALSE(model.view(stamp_at(4.6)).nodes[0].cpu_percent);
}

TEST(TopModel, HostileMessagesStayBoundedAndPrintable) {
  constexpr std::int64_t kMin = std::numeric_limits<std::int64_t>::min();
  constexpr std::int64_t kMax = std::numeric_limits<std::int64_t>::max();
  evaluation::TopModel model;
  for (int i = 0; i < 100; ++i) {
    process_t p = process("\033[2Jnode" + std::to_string(i), 1.0);
    p.start_utime = i % 2 == 0 ? kMin : kMax;
    p.cpu_us = i % 2 == 0 ? kMin : kMax;
    p.note = std::string(10'000, '\x07');
    model.on_process(p, stamp_at(1.0));
    cycle_t c = cycle("sp", 1.0, 1);
    c.wakeup_utime = kMin;
    c.deadline_utime = kMax;
    c.slack_us = kMin;
    c.input[0].channel = "C" + std::to_string(i);
    c.input[0].received = i % 2 == 0 ? kMin : kMax;
    c.input[0].age_us = kMax;
    model.on_cycle(c, stamp_at(1.0 + 0.001 * i));
    event_t e{};
    e.text = "line\nbreak \x9b";
    model.on_event(e, stamp_at(1.0));
  }
  const evaluation::TopView view = model.view(stamp_at(1.2));
  EXPECT_LE(view.nodes.size(), evaluation::TopModel::kMaxNodes);
  EXPECT_LE(view.events.size(), evaluation::TopModel::kMaxEvents);
  for (const TopLine& line : top_lines(view)) {
    for (const char c : line.text) ASSERT_TRUE(c >= 0x20 && c < 0x7f) << static_cast<int>(c);
  }
  EXPECT_NO_THROW((void)to_json(view).dump());
}

TEST(TopScreen, ShowsSilentNodesAndRefusedRequests) {
  evaluation::TopModel model = run_for(3.0);
  process_t wm = process("wm", 1.0);
  wm.note = "SCHED_FIFO 50 not granted";
  model.on_process(wm, stamp_at(1.0));
  const std::string text = text_of(&model, stamp_at(8.0));
  EXPECT_THAT(text, HasSubstr("SILENT 7.00 s"));
  EXPECT_THAT(text, HasSubstr("SILENT 5.00 s"));
  EXPECT_THAT(text, HasSubstr("wm: SCHED_FIFO 50 not granted"));
  EXPECT_THAT(text, HasSubstr(" 60+l"));
  evaluation::TopModel nobody;
  EXPECT_THAT(text_of(&nobody, stamp_at(1.0)), HasSubstr("no node on this bus"));
}

TEST(TopScreen, ShowsTheMessagesOfASecondPublisher) {
  evaluation::TopModel model = run_for(1.0);
  EXPECT_THAT(text_of(&model, stamp_at(1.0)), testing::Not(HasSubstr("rej")));
  cycle_t c = cycle("sp", 1.0, 2'000);
  c.input[0].rejected = 4;
  model.on_cycle(c, stamp_at(1.0));
  EXPECT_THAT(text_of(&model, stamp_at(1.0)), HasSubstr("rej 4"));
  EXPECT_EQ(to_json(model.view(stamp_at(1.0)))["nodes"][0]["inputs"][0]["rejected"], 4);
}

process_t process_of(const std::string& node, std::int32_t pid, std::int64_t publisher) {
  process_t m = process(node, 1.0);
  m.pid = pid;
  m.run_id = 0x2c;
  m.publisher_id = publisher;
  return m;
}

event_t rejection(const std::string& by, const std::string& channel, const std::string& publisher) {
  event_t m{};
  m.node = by;
  m.severity = event_t::SEVERITY_ERROR;
  m.code = "publisher.rejected";
  m.text = channel + ": messages of publisher " + publisher +
           " (run 2c) rejected, 3 so far; the channel belongs to publisher 1 (run 2c)";
  return m;
}

TEST(TopScreen, ShowsTheProcessesAndTheirPublisherIds) {
  evaluation::TopModel model;
  model.on_process(process_of("wm", 501, 0x5b3c1d2e4f607182), stamp_at(1.0));
  model.on_process(process_of("wm", 77, 0xa1), stamp_at(1.0));
  model.on_process(process_of("sp", 500, 0xff00), stamp_at(1.0));
  EXPECT_THAT(text_of(&model, stamp_at(1.5)),
              HasSubstr("processes: process id, publisher id\n"
                        "sp          500  ff00                   wm           77  a1\n"
                        "wm          501  5b3c1d2e4f607182\n"));
  const nlohmann::ordered_json json = to_json(model.view(stamp_at(1.5)));
  EXPECT_EQ(json["nodes"][0]["publisher_id"], "ff00");
  EXPECT_EQ(json["nodes"][0]["run_id"], "2c");
  ASSERT_EQ(json["processes"].size(), 3U);
  EXPECT_EQ(json["processes"][2]["pid"], 501);
  EXPECT_EQ(json["processes"][2]["publisher_id"], "5b3c1d2e4f607182");
  EXPECT_TRUE(json["rejected"].empty());
  // Ended.
  EXPECT_TRUE(model.view(stamp_at(5.0)).processes.empty());
}

TEST(TopScreen, NamesTheProcessOfARejectedPublisher) {
  evaluation::TopModel model;
  model.on_process(process_of("wm", 501, 0x1), stamp_at(1.0));
  model.on_process(process_of("wm", 77, 0xa1), stamp_at(1.0));
  model.on_event(rejection("bg", "WM_NAV_STATE", "a1"), stamp_at(1.0));
  model.on_event(rejection("wm", "INS", "3039"), stamp_at(1.0));
  const std::string text = text_of(&model, stamp_at(1.5));
  EXPECT_THAT(text, HasSubstr("bg rejects WM_NAV_STATE of publisher a1: process 77 (wm)\n"
                              "wm rejects INS of publisher 3039: no process message\n"
                              "processes: process id, publisher id\n"));
  EXPECT_LT(text.find("processes:"), text.find("events, newest first"));
  const nlohmann::ordered_json json = to_json(model.view(stamp_at(1.5)));
  ASSERT_EQ(json["rejected"].size(), 2U);
  EXPECT_EQ(json["rejected"][0]["channel"], "WM_NAV_STATE");
  EXPECT_EQ(json["rejected"][0]["rejected_by"], "bg");
  EXPECT_EQ(json["rejected"][0]["process"]["pid"], 77);
  EXPECT_EQ(json["rejected"][1]["publisher_id"], "3039");
  EXPECT_TRUE(json["rejected"][1]["process"].is_null());
  EXPECT_TRUE(model.view(stamp_at(60.0)).rejected.empty()) << "no event for long";
}

TEST(TopModel, FloodsOfLongTextsAndEverNewProcessesKeepNoMemory) {
  evaluation::TopModel model;
  model.on_process(process_of("wm", 501, 0x1), stamp_at(1.0));
  const std::string text(std::size_t{1} << 20, 'x');
  const auto heap_bytes = [] {
    const struct mallinfo2 heap = mallinfo2();
    return heap.uordblks + heap.hblkhd;
  };
  const std::size_t before = heap_bytes();
  for (int k = 0; k < 200; ++k) {
    process_t p = process_of(text, k, 100 + k);
    p.note = p.config = text;
    model.on_process(p, stamp_at(1.0));
    model.on_event(rejection(text, std::to_string(k) + text, "a" + std::to_string(k)),
                   stamp_at(1.0));
    cycle_t c = cycle("wm", 1.0, 1);
    c.input[0].channel = std::to_string(k) + text;
    model.on_cycle(c, stamp_at(1.0));
  }
  EXPECT_LT(heap_bytes(), before + (std::size_t{1} << 20));
  const evaluation::TopView view = model.view(stamp_at(1.5));
  EXPECT_EQ(view.processes.size(), evaluation::TopModel::kMaxProcesses);
  EXPECT_EQ(view.processes.front().node, "wm") << "displaced by ever new ones";
  EXPECT_EQ(view.rejected.size(), evaluation::TopModel::kMaxRejected);
}

TEST(TopScreen, ShowsTheNavStateTheCommandAndTheEvents) {
  evaluation::TopModel model = run_for(1.0);
  nav_state_t nav{};
  nav.mode = nav_state_t::MODE_INS_LADAR;
  nav.cov_world_pose[0][0] = 0.04;
  nav.age_gps_us = 65'000'000;
  nav.age_prior_map_us = -1;
  nav.distance_since_gps_m = 612.4;
  model.on_nav(nav, stamp_at(1.0));
  status_t status{};
  status.status = status_t::STATUS_EXEC;
  status.state = "FOLLOW";
  status.echo_serial = 5;
  status.issuer = "operator";
  status.emergency_stop = status_t::STOP_PERSISTED;
  model.on_status(status, stamp_at(1.0));
  integrity_t integrity{};
  integrity.protection_horizontal_m = 1.25;
  integrity.protection_vertical_m = 2.5;
  integrity.limit_horizontal_m = 1.0;
  integrity.limit_vertical_m = 5.0;
  integrity.alerts = integrity_t::ALERT_HORIZONTAL;
  integrity.ins = integrity_t::STATUS_SUSPECT;
  integrity.gps = integrity_t::STATUS_QUARANTINE;
  model.on_integrity(integrity, stamp_at(1.0));
  gps_fix_t fix{};
  fix.fix_type = gps_fix_t::FIX_FLOAT;
  fix.satellites = 9;
  model.on_fix(fix, stamp_at(0.9));
  event_t event{};
  event.node = "sp";
  event.severity = event_t::SEVERITY_WARNING;
  event.code = "map.reseeded";
  event.text = "epoch 2";
  event.repeated = 3;
  model.on_event(event, stamp_at(0.5));
  const std::string text = text_of(&model, stamp_at(1.0));
  for (const char* part :
       {"wm INS_LADAR", "0.20 m forward", "612 m since GPS", "gps 65 s", "prior map never",
        "bg EXEC FOLLOW: command 5 of operator", "GPS fix RTK_FLOAT, 9 satellites, 0.10 s ago",
        "protection level horizontal 1.25 of 1.0 m, vertical 2.50 of 5.0 m",
        "sources: INS suspect, GPS quarantine, LADAR none", "alerts: horizontal",
        "emergency stop: LATCHED", "sp warning: map.reseeded: epoch 2 (and 3 times before)"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  const nlohmann::ordered_json json = to_json(model.view(stamp_at(1.0)));
  EXPECT_EQ(json["nav"]["mode"], "INS_LADAR");
  EXPECT_TRUE(json["nav"]["accepted_age_ms"]["prior map"].is_null());
  EXPECT_EQ(json["nodes"][0]["node"], "sp");
}

TEST(TopScreen, ShowsTheMissionAndTheRouteThatItHasChosen) {
  evaluation::TopModel model = run_for(1.0);
  status_t status{};
  status.status = status_t::STATUS_EXEC;
  status.state = "DRIVING_NO_GPS";
  status.echo_serial = 7;
  status.issuer = "operator";
  model.on_mission(status, stamp_at(0.4));
  routes_t routes{};
  routes.alert_limit_m = 5.0;
  route_t dearer{};
  dearer.verdict = route_t::VERDICT_DEARER;
  route_t chosen{};
  chosen.verdict = route_t::VERDICT_CHOSEN;
  chosen.length_m = 812.4;
  chosen.time_s = 201.0;
  chosen.level_max_m = 3.25;
  routes.route = {dearer, chosen};
  routes.n = 2;
  model.on_routes(routes, stamp_at(0.0));
  const std::string text = text_of(&model, stamp_at(1.0));
  EXPECT_THAT(text, HasSubstr("mission EXEC DRIVING_NO_GPS: command 7 of operator, 0.60 s ago\n"));
  EXPECT_THAT(text, HasSubstr("  route: 812 m, 201 s, at most 3.2 m without GPS (limit 5.0 m); of "
                              "2 candidates, 1.00 s ago\n"));
  const nlohmann::ordered_json json = to_json(model.view(stamp_at(1.0)));
  EXPECT_EQ(json["mission"]["state"], "DRIVING_NO_GPS");
  EXPECT_EQ(json["routes"]["candidates"], 2);
  EXPECT_EQ(json["routes"]["chosen"]["length_m"], 812.4);

  routes.route[1].verdict = route_t::VERDICT_ABOVE_LIMIT;
  model.on_routes(routes, stamp_at(5.0));
  const std::string later = text_of(&model, stamp_at(5.0));
  EXPECT_THAT(later, HasSubstr("SILENT 4.60 s"));
  EXPECT_THAT(later, HasSubstr("  route: none of 2 candidates, 0.00 s ago\n"));
  EXPECT_TRUE(to_json(model.view(stamp_at(5.0)))["routes"]["chosen"].is_null());
}

TEST(TopScreen, ShowsPositionAndHeadingOfTheVehicle) {
  evaluation::TopModel model = run_for(1.0);
  nav_state_t nav{};
  nav.world_valid = 1;
  nav.datum_lat_deg = 49.0;
  nav.datum_lon_deg = 8.4;
  nav.p_world_vehicle_m[0] = 10.0;
  nav.p_world_vehicle_m[1] = 111'200.0;  // a degree of latitude is 111.2 km there
  // To the north: a yaw of 90 deg.
  nav.q_world_vehicle[0] = nav.q_world_vehicle[3] = std::sqrt(0.5);
  model.on_nav(nav, stamp_at(1.0));
  EXPECT_THAT(
      text_of(&model, stamp_at(1.0)),
      testing::ContainsRegex("lat (49.99|50.00)[0-9]+ lon 8.400[0-9]+ deg, heading 0.0 deg, "
                             "0.0 m/s\n  E 10.0 N 111200.0 U 0.0 m\n"));
}

TEST(TopScreen, AnEventHasTheTimeOfDayAndTheSecondsOfTheRun) {
  evaluation::TopModel model = run_for(10.0);  // since 0
  event_t event{};
  event.node = "sp";
  event.code = "map.reseeded";
  model.on_event(event, stamp_at(7.5));
  // 12:34:56.789 UTC, 2.5 s after the event.
  constexpr std::int64_t kUtime = 1'395'837'296'789'000;
  EXPECT_THAT(plain_text(top_lines(model.view(stamp_at(10.0), kUtime))),
              HasSubstr("  12:34:54.289 UTC 7.5 s sp info: map.reseeded"));
}

TEST(TopScreen, ASensorWithoutDataIsAWarning) {
  evaluation::TopModel model;
  model.on_process(process("wm", 1.0), stamp_at(1.0));
  cycle_t account = cycle("wm", 1.0, 100);
  account.input[0].channel = "GPS_FIX";
  account.input[0].age_us = -1;
  model.on_cycle(account, stamp_at(1.0));
  bool warned = false;
  for (const TopLine& line : top_lines(model.view(stamp_at(1.0)))) {
    warned = warned || (line.style == TopLine::Style::kWarning &&
                        line.text.find("GPS_FIX             - Hz  never") != std::string::npos);
  }
  EXPECT_TRUE(warned) << text_of(&model, stamp_at(1.0));
}

TEST(TopScreen, AVehicleFits80ColumnsAnd24Rows) {
  evaluation::TopModel model;
  constexpr double kNow_s = 40'000.0;
  for (const char* name : {"bg", "sp", "up", "wm"}) {
    process_t p = process(name, kNow_s);
    p.rss_kb = 80'000;
    model.on_process(p, stamp_at(kNow_s));
    for (const char* input : {"LADAR_RANGES", "INS", "WM_NAV_STATE"}) {
      cycle_t c = cycle(name, kNow_s, 12'345);
      c.input[0].channel = input;
      model.on_cycle(c, stamp_at(kNow_s));
    }
  }
  nav_state_t nav{};
  nav.mode = nav_state_t::MODE_GPS_INS_LADAR;
  nav.pose_valid = nav.world_valid = 1;
  nav.datum_lat_deg = -33.0;
  nav.datum_lon_deg = -148.4;
  nav.p_world_vehicle_m[0] = nav.p_world_vehicle_m[1] = -1234.5;
  nav.q_world_vehicle[0] = 1.0;
  nav.distance_since_gps_m = 12'345.0;
  nav.age_gps_us = 65'000'000;
  model.on_nav(nav, stamp_at(kNow_s));
  integrity_t integrity{};
  integrity.alerts = 31;
  integrity.protection_horizontal_m = integrity.protection_vertical_m = 123.45;
  integrity.limit_horizontal_m = integrity.limit_vertical_m = 100.0;
  integrity.gps = integrity.ladar = integrity_t::STATUS_QUARANTINE;
  model.on_integrity(integrity, stamp_at(kNow_s));
  gps_fix_t fix{};
  fix.fix_type = gps_fix_t::FIX_DIFFERENTIAL;
  model.on_fix(fix, stamp_at(kNow_s));
  status_t status{};
  status.status = status_t::STATUS_EXEC;
  status.state = "EMERGENCY_STOP";
  status.issuer = "operator";
  model.on_status(status, stamp_at(kNow_s));
  std::vector<TopLine> lines = top_lines(model.view(stamp_at(kNow_s)));
  // The processes come last: a window of 24 rows states how many lines are missing.
  const auto processes = std::find_if(lines.begin(), lines.end(), [](const TopLine& line) {
    return line.text.compare(0, 10, "processes:") == 0;
  });
  EXPECT_LT(processes - lines.begin(), 24) << plain_text(lines);
  for (const TopLine& line : lines) EXPECT_LE(line.text.size(), 80U) << line.text;
}

TEST(TopScreen, FitsAnyWindow) {
  evaluation::TopModel model = run_for(2.0);
  const std::vector<TopLine> lines = top_lines(model.view(stamp_at(2.0)));
  for (const int columns : {0, 1, 20, 300}) {
    for (const int rows : {0, 1, 2, static_cast<int>(lines.size()), 100}) {
      const std::string screen = screen_text(lines, {columns, rows});
      const auto line_ends = std::count(screen.begin(), screen.end(), '\n');
      EXPECT_LT(line_ends, std::max(rows, 1)) << columns << " x " << rows;
      if (rows < static_cast<int>(lines.size()) && columns == 300) {
        EXPECT_THAT(screen, HasSubstr("more lines"));
      }
    }
  }
  EXPECT_THAT(screen_text(lines, {300, 100}), Not(HasSubstr("more lines")));
}

}  // namespace
}  // namespace rcs::cli

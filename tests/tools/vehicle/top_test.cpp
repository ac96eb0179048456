#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "tools/evaluation/top_model.h"
#include "tools/rcs/vehicle/top_screen.h"

namespace rcs::cli {
namespace {

using testing::HasSubstr;
using testing::Not;

constexpr Stamp at_s(double s) { return Stamp(from_seconds(s)); }

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
  m.wakeup_utime = to_utime(at_s(t_s));
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
    if (i % 10 == 0) model.on_process(process("sp", t), at_s(t));
    model.on_cycle(cycle("sp", t, i % 100 == 99 ? 30'000 : 2'000 + i % 3), at_s(t));
  }
  return model;
}

std::string text_of(evaluation::TopModel* model, Stamp now) {
  return plain_text(top_lines(model->view(now)));
}

TEST(TopModel, RatesAndTimesCoverTheLastSeconds) {
  evaluation::TopModel model = run_for(10.0);
  const evaluation::TopView view = model.view(at_s(10.0));
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
  const evaluation::TopView later = model.view(at_s(16.0));
  EXPECT_FALSE(later.nodes[0].alive);
  EXPECT_FALSE(later.nodes[0].account_hz);
  EXPECT_FALSE(later.nodes[0].used_max);
  EXPECT_EQ(*later.nodes[0].inputs[0].age, Duration(6'005'000));
}

TEST(TopModel, ARestartGivesNoNegativeLoad) {
  evaluation::TopModel model = run_for(4.0);
  process_t again = process("sp", 0.0);
  again.pid = 78;
  model.on_process(again, at_s(4.5));
  EXPECT_FALSE(model.view(at_s(4.6)).nodes[0].cpu_percent);
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
    model.on_process(p, at_s(1.0));
    cycle_t c = cycle("sp", 1.0, 1);
    c.wakeup_utime = kMin;
    c.deadline_utime = kMax;
    c.slack_us = kMin;
    c.input[0].channel = "C" + std::to_string(i);
    c.input[0].received = i % 2 == 0 ? kMin : kMax;
    c.input[0].age_us = kMax;
    model.on_cycle(c, at_s(1.0 + 0.001 * i));
    event_t e{};
    e.text = "line\nbreak \x9b";
    model.on_event(e, at_s(1.0));
  }
  const evaluation::TopView view = model.view(at_s(1.2));
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
  model.on_process(wm, at_s(1.0));
  const std::string text = text_of(&model, at_s(8.0));
  EXPECT_THAT(text, HasSubstr("SILENT 7.00 s"));
  EXPECT_THAT(text, HasSubstr("SILENT 5.00 s"));
  EXPECT_THAT(text, HasSubstr("wm: SCHED_FIFO 50 not granted"));
  EXPECT_THAT(text, HasSubstr("FIFO 60+lock"));
  evaluation::TopModel nobody;
  EXPECT_THAT(text_of(&nobody, at_s(1.0)), HasSubstr("no node on this bus"));
}

TEST(TopScreen, ShowsTheNavStateTheCommandAndTheEvents) {
  evaluation::TopModel model = run_for(1.0);
  nav_state_t nav{};
  nav.mode = nav_state_t::MODE_INS_LADAR;
  nav.cov_world_pose[0][0] = 0.04;
  nav.age_gps_us = 65'000'000;
  nav.age_prior_map_us = -1;
  nav.distance_since_gps_m = 612.4;
  model.on_nav(nav, at_s(1.0));
  status_t status{};
  status.status = status_t::STATUS_EXEC;
  status.state = "FOLLOW";
  status.echo_serial = 5;
  status.issuer = "operator";
  model.on_status(status, at_s(1.0));
  event_t event{};
  event.node = "sp";
  event.severity = event_t::SEVERITY_WARNING;
  event.code = "map.reseeded";
  event.text = "epoch 2";
  event.repeated = 3;
  model.on_event(event, at_s(0.5));
  const std::string text = text_of(&model, at_s(1.0));
  for (const char* part : {"wm INS_LADAR", "0.20 m forward", "612 m since GPS", "gps 65 s",
                           "prior map never", "bg EXEC FOLLOW: command 5 of operator",
                           "sp warning: map.reseeded: epoch 2 (and 3 times before)"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  const nlohmann::ordered_json json = to_json(model.view(at_s(1.0)));
  EXPECT_EQ(json["nav"]["mode"], "INS_LADAR");
  EXPECT_TRUE(json["nav"]["accepted_age_ms"]["prior map"].is_null());
  EXPECT_EQ(json["nodes"][0]["node"], "sp");
}

TEST(TopScreen, FitsAnyWindow) {
  evaluation::TopModel model = run_for(2.0);
  const std::vector<TopLine> lines = top_lines(model.view(at_s(2.0)));
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

// The shell: messages in, messages out, hostile input, configuration.
#include "modules/wm/wm_node.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/event_t.hpp"
#include "rcs/node/budget.h"
#include "rcs/node/bus/local_bus.h"
#include "tests/support/heap_guard.h"
#include "tests/wm/sensor_messages.h"
#include "tests/wm/synthetic.h"

namespace rcs::wm {
namespace {

/// A WM node on a local bus, driven cycle by cycle.
class WmNodeTest : public ::testing::Test {
 protected:
  explicit WmNodeTest(const WmConfig& config = {})
      : config_(config),
        truth_(make_drive({})),
        sensors_(truth_, config.params, {}),
        node_(config, &bus_),
        nav_states_(&bus_, channel::kWmNavState, 64),
        ins_out_(&bus_, channel::kIns),
        gps_out_(&bus_, channel::kGpsFix),
        odometry_out_(&bus_, channel::kOdometry),
        registration_out_(&bus_, channel::kSpRegistration) {}

  template <class Message>
  void send(Outbox<Message>* outbox, Message m) {
    outbox->publish(&m);
  }
  void cycle(Stamp now) {
    while (bus_.next_due() < Stamp::max()) bus_.deliver_next(now);
    stages_.start_cycle();
    node_.run({0, now, now, now + config_.info.budget, &stages_});
    stages_.end_cycle();
    while (bus_.next_due() < Stamp::max()) bus_.deliver_next(now);
  }
  const nav_state_t& newest() {
    const nav_state_t* m = nav_states_.latest();
    EXPECT_NE(m, nullptr);
    return *m;
  }

  /// All of the drive, with all sensors but odometry.
  void drive() {
    for (std::size_t i = 1; i < truth_.size(); ++i) {
      const Stamp now = truth_[i].stamp;
      send(&ins_out_, message(sensors_.imu(i)));
      if (i % 10 == 0) send(&registration_out_, message(now, sensors_.scan(i)));
      if (i % 20 == 0) send(&gps_out_, message(now, sensors_.gps(i)));
      cycle(now);
    }
  }

  WmConfig config_;
  LocalBus bus_;
  std::vector<Truth> truth_;
  Sensors sensors_;
  StageClock stages_;
  WmNode node_;
  Inbox<nav_state_t> nav_states_;
  Outbox<ins_t> ins_out_;
  Outbox<gps_fix_t> gps_out_;
  Outbox<odometry_t> odometry_out_;
  Outbox<registration_t> registration_out_;
};

TEST_F(WmNodeTest, PublishesTheBeliefOfAllSources) {
  drive();
  const nav_state_t& m = newest();
  EXPECT_EQ(m.mode, int{nav_state_t::MODE_GPS_INS_LADAR});
  EXPECT_EQ(m.utime, to_utime(truth_.back().stamp));
  EXPECT_EQ(m.world_valid, 1);
  EXPECT_EQ(m.rolling_valid, 1);
  EXPECT_EQ(m.map_epoch, 1);
  EXPECT_EQ(m.age_ins_us, 0);
  EXPECT_EQ(m.latency_trace.last_facet_utime, m.utime + 5);
  // The datum is the first fix, which is the origin of frame world.
  const LocalFrame frame({radians(m.datum_lat_deg), radians(m.datum_lon_deg), {m.datum_height_m}});
  const Vec3 truth =
      frame.to_world(LocalFrame(test_datum()).to_geodetic(truth_.back().T_world_vehicle.p));
  EXPECT_LT((from_message(m.p_world_vehicle_m) - truth).norm(), 1.5);
}

// Sensor time stands still when all sensors are silent: the silence is measured in node time.
TEST_F(WmNodeTest, WithoutInputTheModeIsLostAndThenThePoseIsInvalid) {
  Inbox<integrity_t> integrities(&bus_, channel::kWmIntegrity, 64);
  drive();
  EXPECT_EQ(newest().pose_valid, 1);
  EXPECT_EQ(integrities.latest()->validity, int{integrity_t::VALID_WORLD});
  EXPECT_EQ(integrities.latest()->ins, int{integrity_t::STATUS_ACCEPTED});
  EXPECT_TRUE(std::isfinite(integrities.latest()->protection_horizontal_m));
  const Stamp end = truth_.back().stamp;
  for (int k = 1; k <= 9; ++k) cycle(end + from_milliseconds(20.0 * k));
  EXPECT_EQ(newest().mode, int{nav_state_t::MODE_GPS_INS_LADAR});
  for (int k = 10; k <= 20; ++k) cycle(end + from_milliseconds(20.0 * k));
  EXPECT_EQ(newest().mode, int{nav_state_t::MODE_LOST});
  EXPECT_EQ(newest().pose_valid, 1);
  EXPECT_GE(newest().age_ins_us, 380'000);
  for (int k = 21; k <= 100; ++k) cycle(end + from_milliseconds(20.0 * k));
  EXPECT_EQ(newest().pose_valid, 0);
  EXPECT_GE(newest().age_ins_us, 1'900'000);
  EXPECT_GE(newest().age_gps_us, 1'900'000);
  EXPECT_GE(newest().age_rolling_us, 1'900'000);
  EXPECT_EQ(newest().utime, to_utime(end));
  const integrity_t& m = *integrities.latest();
  EXPECT_EQ(m.validity, int{integrity_t::VALID_NONE});
  EXPECT_TRUE(std::isinf(m.protection_horizontal_m));
  EXPECT_EQ(m.ins, int{integrity_t::STATUS_NONE});
  EXPECT_NE(m.alerts & integrity_t::ALERT_INPUT, 0);
  EXPECT_NE(m.alerts & integrity_t::ALERT_HORIZONTAL, 0);
}

// One kind of sensor without INS does not move the belief (ADR 19): that is no input.
TEST_F(WmNodeTest, WhatDoesNotMoveTheBeliefIsNoInput) {
  drive();
  const Stamp end = truth_.back().stamp;
  std::vector<bool> lost;
  for (int k = 1; k <= 100; ++k) {
    const Stamp now = end + from_milliseconds(20.0 * k);
    if (k % 5 == 0) send(&registration_out_, message(now, sensors_.scan(truth_.size() - 1)));
    cycle(now);
    lost.push_back(newest().mode == nav_state_t::MODE_LOST);
  }
  EXPECT_FALSE(lost[20]);
  EXPECT_TRUE(lost[30]);
  EXPECT_EQ(newest().pose_valid, 0);
}

// SP reports each scan, also one that it could not register.
TEST_F(WmNodeTest, ScansWithoutResultAreASilenceOfTheLadar) {
  Inbox<event_t> events(&bus_, channel::kWmEvent, 64);
  drive();
  const Stamp end = truth_.back().stamp;
  for (int k = 1; k <= 10; ++k) {
    const Stamp now = end + from_milliseconds(100.0 * k);
    registration_t failed{};
    failed.utime = to_utime(now);
    failed.stop = registration_t::STOP_TOO_FEW;
    send(&registration_out_, failed);
    cycle(now);
  }
  bool reported = false;
  for (; !events.empty(); events.pop()) {
    reported = reported || events.front()->code == "input.ladar";
  }
  EXPECT_TRUE(reported);
}

// Without a known frame world there is no bound of the position.
TEST_F(WmNodeTest, WithoutADatumNoProtectionLevelIsPublished) {
  Inbox<integrity_t> integrities(&bus_, channel::kWmIntegrity, 64);
  for (std::size_t i = 1; i < truth_.size(); ++i) {
    send(&ins_out_, message(sensors_.imu(i)));
    if (i % 10 == 0) send(&registration_out_, message(truth_[i].stamp, sensors_.scan(i)));
    cycle(truth_[i].stamp);
  }
  EXPECT_EQ(newest().world_valid, 0);
  const integrity_t& m = *integrities.latest();
  EXPECT_EQ(m.validity, int{integrity_t::VALID_LOCAL});
  EXPECT_TRUE(std::isinf(m.protection_horizontal_m));
  EXPECT_TRUE(std::isinf(m.protection_vertical_m));
  EXPECT_EQ(m.alerts, 0);
}

TEST_F(WmNodeTest, NoWorldPoseBeforeTheHeadingIsKnown) {
  for (std::size_t i = 1; i < 600; ++i) {
    const Stamp now = truth_[i].stamp;
    send(&ins_out_, message(sensors_.imu(i)));
    if (i % 20 == 0 && i < 400) send(&gps_out_, message(now, sensors_.gps(i)));
    cycle(now);
  }
  const nav_state_t& m = newest();
  EXPECT_EQ(m.world_valid, 0);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(m.p_world_vehicle_m[k], m.p_local_vehicle_m[k]);
  EXPECT_EQ(m.mode, int{nav_state_t::MODE_INS_DR});
}

TEST_F(WmNodeTest, WhatTheAlignmentLacksIsReportedWithinTenSeconds) {
  Inbox<event_t> events(&bus_, channel::kWmEvent, 64);
  const auto reported = [&](const std::string& text) {
    bool found = false;
    for (; !events.empty(); events.pop()) {
      const event_t& e = *events.front();
      found = found || (e.code == "alignment.waiting" && e.text.find(text) != std::string::npos);
    }
    return found;
  };
  // The same fix again and again: a vehicle at rest.
  const GeodeticFix fix = sensors_.gps(1);
  const auto stand = [&](double from_s, double to_s, bool gps) {
    for (double t = from_s; t < to_s; t += 0.01) {
      const Stamp now = from_utime(1'000'000'000) + from_seconds(t);
      ImuSample imu = sensors_.imu(1);
      imu.stamp = now;
      send(&ins_out_, message(imu));
      if (gps && std::fmod(t, 0.2) < 0.01) send(&gps_out_, message(now, fix));
      cycle(now);
    }
  };
  stand(0.01, 10.0, false);
  EXPECT_TRUE(reported("no GPS fix and no match"));
  stand(10.0, 20.0, true);
  EXPECT_TRUE(reported("heading unknown; drive 5 m with turns"));
  stand(20.0, 40.0, true);
  EXPECT_FALSE(reported("")) << "reported once";
}

TEST_F(WmNodeTest, TheEndOfAShortAlertIsPublished) {
  Inbox<event_t> events(&bus_, channel::kWmEvent, 64);
  const Duration pause = from_milliseconds(500.0);
  Duration paused = Duration::zero();
  for (std::size_t i = 1; i < truth_.size(); ++i) {
    const Stamp now = truth_[i].stamp + paused;
    send(&ins_out_, message(sensors_.imu(i)));
    if (i % 20 == 0) send(&gps_out_, message(truth_[i].stamp, sensors_.gps(i)));
    cycle(now);
    if (i != truth_.size() / 2) continue;
    for (paused = Duration::zero(); paused < pause; paused += from_milliseconds(20.0)) {
      cycle(now + paused);
    }
  }
  std::vector<event_t> alerts;
  for (; !events.empty(); events.pop()) {
    if (events.front()->code == "alert") alerts.push_back(*events.front());
    if (events.front()->code != "world.reset") continue;
    EXPECT_EQ(events.front()->severity, int{event_t::SEVERITY_INFO});
    EXPECT_EQ(events.front()->text.find("frame world initialized: "), 0U) << events.front()->text;
  }
  ASSERT_EQ(alerts.size(), 2U);
  EXPECT_EQ(alerts[0].severity, int{event_t::SEVERITY_WARNING});
  EXPECT_EQ(alerts[0].text, "input alert: no sensor is received");
  EXPECT_EQ(alerts[1].severity, int{event_t::SEVERITY_INFO});
  EXPECT_EQ(alerts[1].text, "alerts ended");
  EXPECT_LT(alerts[1].utime - alerts[0].utime, to_utime(Stamp() + pause));
}

class WmNodeWithLimits : public WmNodeTest {
 protected:
  WmNodeWithLimits() : WmNodeTest(config()) {}
  static WmConfig config() {
    WmConfig c;
    c.params.integrity.limit_horizontal_m = 0.1;
    return c;
  }
};

TEST_F(WmNodeWithLimits, AnAlertStatesTheLevelAndItsLimit) {
  Inbox<event_t> events(&bus_, channel::kWmEvent, 64);
  drive();
  std::string first;
  for (; !events.empty(); events.pop()) {
    if (events.front()->code == "alert" && first.empty()) first = events.front()->text;
  }
  EXPECT_THAT(first, testing::MatchesRegex(
                         "horizontal alert: protection level [0-9]+.[0-9][0-9] m > 0.10 m"));
}

TEST_F(WmNodeTest, RunsPeriodicallyAndAtOnceForARegistration) {
  cycle(from_utime(1000));
  EXPECT_EQ(node_.next_wakeup(), from_utime(1000) + config_.period);
  send(&registration_out_, message(from_utime(2000), sensors_.scan(1)));
  bus_.deliver_next(from_utime(2500));
  EXPECT_EQ(node_.next_wakeup(), from_utime(2500));
}

TEST_F(WmNodeTest, TheLatencyTraceHasTheScansArrivalAndItsFirstUse) {
  const registration_t scan = message(truth_[10].stamp, sensors_.scan(10));
  send(&registration_out_, scan);
  bus_.deliver_next(truth_[11].stamp);
  cycle(truth_[12].stamp);
  const latency_trace_t first = newest().latency_trace;
  EXPECT_EQ(first.measured_utime, scan.utime);
  EXPECT_EQ(first.last_facet_utime, scan.latency_trace.last_facet_utime);
  EXPECT_EQ(first.wm_arrival_utime, to_utime(truth_[11].stamp));
  EXPECT_EQ(first.wm_start_utime, to_utime(truth_[12].stamp));
  // Later nav states keep it, and a registration that is not a match leaves no trace.
  registration_t held = message(truth_[20].stamp, sensors_.scan(20));
  held.stop = registration_t::STOP_HELD;
  send(&registration_out_, held);
  cycle(truth_[21].stamp);
  EXPECT_EQ(newest().latency_trace.measured_utime, scan.utime);
  EXPECT_EQ(newest().latency_trace.wm_start_utime, to_utime(truth_[12].stamp));
}

TEST_F(WmNodeTest, LadarAloneIsSufficient) {
  for (std::size_t i = 10; i < truth_.size(); i += 10) {
    send(&registration_out_, message(truth_[i].stamp, sensors_.scan(i)));
    cycle(truth_[i].stamp);
  }
  const nav_state_t& m = newest();
  EXPECT_EQ(m.mode, int{nav_state_t::MODE_LADAR});
  EXPECT_EQ(m.utime, to_utime(truth_.back().stamp));
  EXPECT_EQ(m.world_valid, 0);
}

TEST_F(WmNodeTest, InvalidMessagesChangeNothing) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  std::mt19937 random(1);
  std::uniform_int_distribution<int> pick(0, 11);
  for (std::size_t i = 1; i < truth_.size(); ++i) {
    const Stamp now = truth_[i].stamp;
    send(&ins_out_, message(sensors_.imu(i)));
    const GeodeticFix fix = sensors_.gps(i);
    const RollingMatch scan = sensors_.scan(i);
    if (i % 10 == 0) send(&registration_out_, message(now, scan));
    if (i % 20 == 0) send(&gps_out_, message(now, fix));

    ins_t ins = message(sensors_.imu(i));
    ins.utime += 1;
    gps_fix_t gps = message(now + Duration(1), fix);
    registration_t registration = message(now + Duration(1), scan);
    registration.stop = registration_t::STOP_CONVERGED;
    odometry_t odometry{};
    odometry.utime = to_utime(now);
    odometry.sigma_speed_mps = 0.1;
    switch (pick(random)) {
      case 0:
        ins.delta_v_mps[1] = nan;
        break;
      case 1:
        ins.interval_us = 0;
        break;
      case 2:
        ins.delta_angle_rad[0] = inf;
        break;
      case 3:
        ins.valid = 0;
        break;
      case 4:
        ins.utime = std::numeric_limits<std::int64_t>::max();
        break;
      case 5:
        ins.interval_us = -10000;
        break;
      default:
        ins.delta_angle_rad[2] = 1e9;
        break;
    }
    switch (pick(random)) {
      case 0:
        gps.lat_deg = nan;
        break;
      case 1:
        gps.lat_deg = gps.lon_deg = 0.0;
        break;
      case 2:
        gps.sigma_enu_m[0] = 0.0;
        break;
      case 3:
        gps.sigma_enu_m[2] = nan;
        break;
      case 4:
        gps.fix_type = gps_fix_t::FIX_NONE;
        break;
      case 5:
        gps.height_kind = 7;
        break;
      case 6:
        gps.height_kind = gps_fix_t::HEIGHT_ORTHOMETRIC;
        gps.undulation_m = nan;
        break;
      default:
        gps.lat_deg = 91.0;
        break;
    }
    switch (pick(random)) {
      case 0:
        registration.q_target_vehicle[0] = nan;
        break;
      case 1:
        registration.information[2][2] = inf;
        break;
      case 2:
        registration.information[3][3] = -1.0;
        break;
      case 3:
        registration.p_target_vehicle_m[0] = 1e12;
        break;
      case 4:
        registration.stop = registration_t::STOP_DIVERGED;
        break;
      case 5:
        registration.target = 9;
        break;
      default:
        for (double& q : registration.q_target_vehicle) q = 0.0;
        break;
    }
    switch (pick(random)) {
      case 0:
        odometry.speed_mps = nan;
        break;
      case 1:
        odometry.sigma_speed_mps = -1.0;
        break;
      case 2:
        odometry.interval_us = -1;
        break;
      default:
        odometry.speed_mps = 1e6;
        break;
    }
    send(&ins_out_, ins);
    send(&gps_out_, gps);
    send(&registration_out_, registration);
    send(&odometry_out_, odometry);
    cycle(now);
  }
  const nav_state_t& m = newest();
  EXPECT_EQ(m.mode, int{nav_state_t::MODE_GPS_INS_LADAR});
  EXPECT_EQ(m.age_odometry_us, -1);
  const LocalFrame frame({radians(m.datum_lat_deg), radians(m.datum_lon_deg), {m.datum_height_m}});
  const Vec3 truth =
      frame.to_world(LocalFrame(test_datum()).to_geodetic(truth_.back().T_world_vehicle.p));
  EXPECT_LT((from_message(m.p_world_vehicle_m) - truth).norm(), 1.5);
}

TEST_F(WmNodeTest, ACycleDoesNotAllocate) {
  if (!test::HeapGuard::available()) GTEST_SKIP() << "a sanitizer owns malloc";
  std::int64_t allocations = 0;
  for (std::size_t i = 1; i < truth_.size(); ++i) {
    const Stamp now = truth_[i].stamp;
    send(&ins_out_, message(sensors_.imu(i)));
    if (i % 10 == 0) send(&registration_out_, message(now, sensors_.scan(i)));
    if (i % 20 == 0) send(&gps_out_, message(now, sensors_.gps(i)));
    while (bus_.next_due() < Stamp::max()) bus_.deliver_next(now);
    const test::HeapGuard guard;
    cycle(now);
    if (i > 2000) allocations += guard.allocations();
  }
  EXPECT_EQ(allocations, 0);
}

// The map is used for queries only; the pose does not need it.
TEST(WmNode, StartsAndReportsAMapThatCannotBeRead) {
  const Result<ParamFile> file =
      ParamFile::parse("[world]\nprior_map = \"/nonexistent/map\"\n", "test.toml");
  ASSERT_TRUE(file);
  LocalBus bus;
  Inbox<event_t> events(&bus, channel::kWmEvent, 4);
  Result<std::unique_ptr<Node>> node = make_wm_node(*file, &bus);
  ASSERT_TRUE(node) << node.error().message;
  const Stamp now = from_utime(1'000'000);
  StageClock stages;
  stages.start_cycle();
  (*node)->run({0, now, now, now + from_milliseconds(10.0), &stages});
  while (bus.next_due() < Stamp::max()) bus.deliver_next(now);
  ASSERT_NE(events.front(), nullptr);
  EXPECT_EQ(events.front()->code, "map.none");
  EXPECT_NE(events.front()->text.find("/nonexistent/map"), std::string::npos);
}

TEST(WmConfig, ReadsGradesAndRejectsUnknownKeys) {
  const auto load = [](const std::string& text) -> Result<WmConfig> {
    Result<ParamFile> file = ParamFile::parse(text, "test.toml");
    if (!file) return file.error();
    return load_wm_config(*file);
  };
  const Result<WmConfig> good =
      load("[ins]\ngrade = \"industrial\"\naccel_turn_on_mg = 7.0\n[wm.history]\nlag_ms = 500.0\n");
  ASSERT_TRUE(good) << good.error().message;
  EXPECT_NEAR(good->params.ins.accel_turn_on, 7.0 * 9.80665e-3, 1e-12);
  EXPECT_EQ(good->params.history.lag, from_milliseconds(500.0));
  EXPECT_FALSE(good->datum);
  EXPECT_FALSE(load("[ins]\ngrade = \"golden\"\n"));
  EXPECT_FALSE(load("[wm.align]\nbaseline = 5.0\n"));
  EXPECT_FALSE(load("[wm.history]\ncapacity = 3\n"));
  EXPECT_FALSE(load("[wm.history]\nlag_ms = 3000.0\njump_ms = 1000.0\n"));
  EXPECT_FALSE(load("[world]\ndatum_lat_deg = 49.0\n"));
  EXPECT_TRUE(load("[world]\ndatum_lat_deg = 49.0\ndatum_lon_deg = 8.0\ndatum_height_m = 0.0\n"));
}

}  // namespace
}  // namespace rcs::wm

#include "sim/simulator.h"

#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/bus/outbox.h"
#include "sim/terrain/clearance.h"
#include "tests/sim/worlds.h"

namespace rcs::sim {
namespace {

Scenario short_drive() {
  Scenario s;
  s.seed = 3;
  s.duration_s = 6.0;
  s.world = bare_hills();
  s.world.rocks.per_m2 = 0.02;
  s.course = s_course();
  s.gps.outages = {{2.0, 1.0}};
  return s;
}

struct Recorded {
  Stamp due;
  SourceEvent event;
};

std::vector<Recorded> run(const Scenario& scenario) {
  Simulator simulator(scenario);
  std::vector<Recorded> all;
  while (simulator.peek() != Stamp::max()) {
    Recorded r;
    r.due = simulator.peek();
    EXPECT_EQ(simulator.peek(), r.due);
    simulator.take(&r.event);
    all.push_back(r);
  }
  return all;
}

template <class T>
T decoded(const SourceEvent& event) {
  T m{};
  EXPECT_EQ(m.decode(event.data.data(), 0, static_cast<int>(event.data.size())),
            static_cast<int>(event.data.size()));
  return m;
}

bool same(const std::vector<Recorded>& a, const std::vector<Recorded>& b) {
  if (a.size() != b.size()) return false;
  for (std::size_t k = 0; k < a.size(); ++k) {
    if (a[k].due != b[k].due || a[k].event.channel != b[k].event.channel ||
        a[k].event.data != b[k].event.data) {
      return false;
    }
  }
  return true;
}

TEST(Simulator, TheSeedDeterminesTheBytes) {
  Scenario s = short_drive();
  s.duration_s = 2.0;
  const std::vector<Recorded> once = run(s);
  EXPECT_TRUE(same(once, run(s)));
  s.seed = 4;
  EXPECT_FALSE(same(once, run(s)));
}

TEST(Simulator, EventsAreInOrderOfTimeAtTheirRates) {
  const std::vector<Recorded> all = run(short_drive());
  std::map<std::string, int> count;
  Stamp last = Stamp::min();
  for (const Recorded& r : all) {
    EXPECT_LE(last, r.due);
    last = r.due;
    ++count[r.event.channel];
    EXPECT_LE(r.event.data.size(), 60000U);  // one datagram
  }
  EXPECT_EQ(count[channel::kIns], 600);
  EXPECT_EQ(count[channel::kOdometry], 120);
  EXPECT_EQ(count[channel::kGpsFix], 30 - 5);  // a second of outage
  EXPECT_EQ(count[channel::kLadarRanges], 60 * 16);
  EXPECT_EQ(count[channel::kSimTruth], 600);
}

TEST(Simulator, FacetsCarryTheirTimesAndArriveAfterTheirLastShot) {
  const Scenario s = short_drive();
  std::int64_t seq = 0;
  for (const Recorded& r : run(s)) {
    if (r.event.channel != channel::kLadarRanges) continue;
    const ladar_ranges_t m = decoded<ladar_ranges_t>(r.event);
    EXPECT_EQ(m.seq, ++seq);
    EXPECT_EQ(m.scan_id * 16 + m.facet + 1, seq);
    const std::int64_t true_utime = to_utime(Simulator::kStart) + (seq - 1) * 6250;
    EXPECT_EQ(m.utime, true_utime + 5000);  // the sensor's clock has an offset of 5 ms
    EXPECT_EQ(m.duration_us, 6250);
    EXPECT_EQ(m.reference_utime, to_utime(Simulator::kStart) + (m.scan_id + 1) * 100000 + 5000);
    EXPECT_EQ(to_utime(r.due), true_utime + 6250 + 1000);
    EXPECT_EQ(m.first_row, 2 * m.facet);
    EXPECT_TRUE(m.n == 360 || m.n == 0);
  }
  EXPECT_EQ(seq, 960);
}

TEST(Simulator, TruthIsTheTrajectory) {
  const Scenario s = short_drive();
  const Simulator simulator(s);
  for (const Recorded& r : run(s)) {
    if (r.event.channel != channel::kSimTruth) continue;
    const truth_t m = decoded<truth_t>(r.event);
    Pose T;
    ASSERT_TRUE(from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T));
    const double t = seconds(from_utime(m.utime) - Simulator::kStart);
    EXPECT_LT(log_se3(simulator.vehicle().pose_at(t).inverse() * T).norm(), 1e-9);
    const Clearance truth = clearance(simulator.world(), T, Footprint());
    EXPECT_NEAR(m.clearance_m, truth.hard_m, 1e-9);
    EXPECT_EQ(m.foliage_contact, truth.foliage ? 1 : 0);
  }
}

TEST(Simulator, SpinningLadarGivesPointsInSectors) {
  Scenario s = short_drive();
  s.duration_s = 0.3;
  s.ladar = LadarKind::kSpinning;
  s.beam.max_range_m = 120.0;
  int sectors = 0;
  for (const Recorded& r : run(s)) {
    if (r.event.channel != channel::kLadarPoints) continue;
    ++sectors;
    const ladar_points_t m = decoded<ladar_points_t>(r.event);
    EXPECT_LE(r.event.data.size(), 60000U);
    EXPECT_EQ(m.facet_count, 48);
    EXPECT_EQ(m.n_index, m.n);
    EXPECT_EQ(m.n_time, m.n);
    for (const std::int32_t dt : m.dt_us) EXPECT_TRUE(dt >= 0 && dt < 2100);
  }
  EXPECT_EQ(sectors, 3 * 48);
}

TEST(Simulator, NothingIsSentWhileTheLadarIsOut) {
  Scenario s = short_drive();
  s.ladar_outages = {{2.0, 1.5}};
  int scans = 0;
  for (const Recorded& r : run(s)) {
    if (r.event.channel != channel::kLadarRanges) continue;
    const double t = seconds(r.due - Simulator::kStart);
    EXPECT_TRUE(t < 2.01 || t > 3.5) << t;
    const ladar_ranges_t m = decoded<ladar_ranges_t>(r.event);
    scans += m.facet == 15 ? 1 : 0;
    EXPECT_EQ(m.scan_id, static_cast<std::int64_t>((t - 0.002) / 0.1));
  }
  EXPECT_EQ(scans, 45);
}

TEST(Simulator, GpsIsLostPermanentlyAfterADistance) {
  Scenario s = short_drive();
  s.gps.outages.clear();
  const std::vector<Recorded> whole = run(s);
  s.gps.lost_after_m = 5.0;
  double last_s = 0.0;
  std::size_t same_fixes = 0;
  for (const Recorded& r : run(s)) {
    if (r.event.channel != channel::kGpsFix) continue;
    last_s = seconds(r.due - Simulator::kStart);
    ++same_fixes;
  }
  const Simulator simulator(s);
  const double way_m = simulator.course().distance_at(last_s);
  EXPECT_GT(way_m, 3.0);
  EXPECT_LT(way_m, 7.0);
  // Until then the fixes are the same as without the loss.
  const std::vector<Recorded> part = run(s);
  std::vector<SourceEvent> a, b;
  for (const Recorded& r : part) {
    if (r.event.channel == channel::kGpsFix) a.push_back(r.event);
  }
  for (const Recorded& r : whole) {
    if (r.event.channel == channel::kGpsFix) b.push_back(r.event);
  }
  ASSERT_LT(a.size(), b.size());
  ASSERT_EQ(a.size(), same_fixes);
  for (std::size_t k = 0; k < a.size(); ++k) EXPECT_EQ(a[k].data, b[k].data);
}

Scenario commanded_drive() {
  Scenario s = short_drive();
  s.commanded = true;
  s.duration_s = 20.0;
  s.ladar = LadarKind::kNone;
  return s;
}

/// Drives straight on at 4 m/s from the 1st to the 10th second, then sends no more commands.
class StraightOn {
 public:
  explicit StraightOn(Simulator* simulator) : simulator_(simulator) {}
  void at(Stamp now) {
    const double t = seconds(now - Simulator::kStart);
    if (t < 1.0 || t > 10.0 || now < next_) return;
    drive_t m{};
    m.utime = to_utime(now);
    m.seq = ++seq_;
    m.valid_until_utime = to_utime(now + from_seconds(0.3));
    m.speed_mps = 4.0;
    simulator_->command(m, now);
    next_ = now + from_seconds(0.05);
  }

 private:
  Simulator* simulator_;
  std::int64_t seq_ = 0;
  Stamp next_ = Stamp::min();
};

TEST(Simulator, ACommandedVehicleDrivesWhileCommandsArrive) {
  Simulator simulator(commanded_drive());
  StraightOn driver(&simulator);
  SourceEvent event;
  double fastest_mps = 0.0;
  truth_t truth{};
  while (simulator.peek() != Stamp::max()) {
    driver.at(simulator.peek());
    simulator.take(&event);
    if (event.channel == channel::kSimTruth) {
      truth = decoded<truth_t>(event);
      const double speed = from_message(truth.v_world_mps).head<2>().norm();
      fastest_mps = std::max(fastest_mps, speed);
    }
  }
  EXPECT_NEAR(fastest_mps, 4.0, 0.05);
  EXPECT_LT(from_message(truth.v_world_mps).norm(), 0.01);
  EXPECT_NEAR(simulator.driven_m(), 4.0 * (9.0 + 0.3) - 4.0 + 16.0 / 6.0, 0.5);
  const Vec2 heading = (simulator.course().points()[1] - simulator.course().points()[0]);
  EXPECT_GT(from_message(truth.p_world_vehicle_m).head<2>().dot(heading.normalized()), 30.0);
  EXPECT_EQ(simulator.commanded_vehicle()->model().account().silences, 1);
}

TEST(Simulator, ACommandedDriveIsRepeatableToTheByte) {
  const auto bytes = [] {
    Scenario s = commanded_drive();
    s.ladar = LadarKind::kImager;
    s.duration_s = 4.0;
    Simulator simulator(s);
    StraightOn driver(&simulator);
    std::vector<Recorded> all;
    while (simulator.peek() != Stamp::max()) {
      driver.at(simulator.peek());
      Recorded r;
      r.due = simulator.peek();
      simulator.take(&r.event);
      all.push_back(r);
    }
    return all;
  };
  EXPECT_TRUE(same(bytes(), bytes()));
}

TEST(Simulator, ReceivesDriveCommandsOnABusWithADifferentTime) {
  Simulator simulator(commanded_drive());
  LocalBus bus;
  const Duration shift = from_seconds(12345.678);
  simulator.listen(&bus, shift);
  Outbox<drive_t> drive(&bus, channel::kBgDrive);
  SourceEvent event;
  for (int k = 0; simulator.peek() < Simulator::kStart + from_seconds(3.0); ++k) {
    const Stamp now = simulator.peek() + shift;
    drive_t m{};
    m.utime = to_utime(now);
    m.valid_until_utime = to_utime(now + from_seconds(0.2));
    m.speed_mps = 2.0;
    if (k == 50) m.utime = std::numeric_limits<std::int64_t>::max();
    if (k == 51) m.utime = std::numeric_limits<std::int64_t>::min();
    drive.publish(&m);
    bus.deliver_next(now);
    simulator.take(&event);
  }
  const DriveAccount& account = simulator.commanded_vehicle()->model().account();
  EXPECT_EQ(account.implausible, 2);
  EXPECT_GT(account.taken, 500);
  EXPECT_NEAR(simulator.commanded_vehicle()->model().speed_mps(), 2.0, 1e-9);
}

// What another program commands neither moves the vehicle nor releases an emergency stop.
TEST(Simulator, ObeysOnePublisherAndNoReleaseOfAnotherRun) {
  Simulator simulator(commanded_drive());
  LocalBus bus;
  simulator.listen(&bus, Duration(0));
  Outbox<drive_t> drive(&bus, channel::kBgDrive);
  SourceEvent event;
  Duration age{};  // of the commands
  const auto publish = [&](const Publisher& from, double speed_mps, bool stops) {
    const Stamp now = simulator.peek() - age;
    drive_t m{};
    m.run_id = from.run_id;
    m.publisher_id = from.publisher_id;
    m.utime = to_utime(now);
    m.valid_until_utime = to_utime(now + from_seconds(0.2));
    m.speed_mps = speed_mps;
    m.emergency_stop = stops ? 1 : 0;
    std::vector<std::uint8_t> bytes(static_cast<std::size_t>(m.getEncodedSize()));
    m.encode(bytes.data(), 0, m.getEncodedSize());
    bus.publish(channel::kBgDrive, bytes.data(), bytes.size());
    bus.deliver_next(simulator.peek());
    simulator.take(&event);
  };
  const auto until = [&](double t_s, auto&& step) {
    while (simulator.peek() < Simulator::kStart + from_seconds(t_s)) step();
  };
  const Publisher bg{1, 10}, successor{1, 11}, other{2, 20};
  const DriveModel& vehicle = simulator.commanded_vehicle()->model();
  until(1.0, [&] {
    publish(bg, 0.0, true);
    publish(other, 2.0, false);
  });
  until(3.0, [&] { publish(other, 2.0, false); });
  // An expired command of the same run releases nothing.
  age = from_seconds(5.0);
  publish(bg, 2.0, false);
  age = {};
  until(3.5, [&] { publish(other, 2.0, false); });
  EXPECT_EQ(simulator.driven_m(), 0.0) << "the stop outlives the program that has set it";
  EXPECT_GT(simulator.rejected_commands(), 100);
  // After two publishers a third one is accepted when BG has been silent for 3 s.
  until(8.0, [&] { publish(successor, 2.0, false); });
  EXPECT_NEAR(vehicle.speed_mps(), 2.0, 1e-9) << "of the same run";
  until(9.0, [&] {
    publish(successor, 2.0, false);
    publish(other, 0.0, true);
  });
  EXPECT_NEAR(vehicle.speed_mps(), 2.0, 1e-9) << "BG, not the vehicle, takes stops of anyone";
  until(14.0, [&] { publish(other, 1.0, true); });
  EXPECT_EQ(vehicle.speed_mps(), 0.0);
  until(15.0, [&] { publish(other, 1.0, false); });
  EXPECT_GT(vehicle.speed_mps(), 0.5) << "a new run that has repeated the stop first";
}

TEST(Simulator, WritesItsEventsAsALog) {
  Scenario s = short_drive();
  s.duration_s = 1.0;
  const std::string path = testing::TempDir() + "rcs_simulator_test.lcm";
  Result<LogWriter> log = LogWriter::create(path);
  ASSERT_TRUE(log);
  double progress = 0.0;
  ASSERT_TRUE(simulate_to_log(s, &*log, [&](double share) { progress = share; }));
  EXPECT_EQ(progress, 1.0);
  Result<LogReader> reader = LogReader::open(path);
  ASSERT_TRUE(reader);
  LogEvent event;
  for (const Recorded& r : run(s)) {
    ASSERT_TRUE(reader->next(&event));
    EXPECT_EQ(event.stamp, r.due);
    EXPECT_EQ(event.channel, r.event.channel);
    EXPECT_EQ(event.data, r.event.data);
  }
  EXPECT_FALSE(reader->next(&event));
  std::remove(path.c_str());
}

}  // namespace
}  // namespace rcs::sim

#include "sim/simulator.h"

#include <gtest/gtest.h>

#include <map>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/ins_t.hpp"
#include "lcmtypes/rcs/ladar_points_t.hpp"
#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
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

TEST(Simulator, SameSeedSameBytesOtherSeedOtherBytes) {
  Scenario s = short_drive();
  s.duration_s = 2.0;
  const std::vector<Recorded> once = run(s);
  EXPECT_TRUE(same(once, run(s)));
  s.seed = 4;
  EXPECT_FALSE(same(once, run(s)));
}

TEST(Simulator, EventsComeInTheOrderOfTimeAtTheirRates) {
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
    EXPECT_EQ(m.utime, true_utime + 5000);  // the sensor's clock is 5 ms off
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

TEST(Simulator, WritesALogThatIsItsEvents) {
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

// The closed loop with a driver that uses ground truth. This tests the harness, and that SP and WM
// keep up with a driven vehicle.

#include "tools/driving/closed_loop.h"
#include "tools/driving/run_picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/drive_t.hpp"
#include "rcs/node/command_port.h"
#include "sim/scenario_file.h"
#include "tests/replay/chain.h"

namespace rcs::test {
namespace {

/// Pure pursuit from waypoint to waypoint by the simulator's ground truth, without obstacle
/// avoidance.
class Cheat final : public Node {
 public:
  Cheat(Bus* bus, const sim::Simulator& simulator)
      : simulator_(simulator),
        subordinate_(bus, "bg", channel::kBgCommand, channel::kBgStop, channel::kBgStatus, {}),
        drive_(bus, channel::kBgDrive) {}

  [[nodiscard]] const NodeInfo& info() const override { return info_; }
  [[nodiscard]] Stamp next_wakeup() const override { return clock_.next(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override {
    return {&subordinate_.inbox()};
  }

  void run(const Cycle& cycle) override {
    clock_.advance(cycle.now);
    subordinate_.take(cycle.now);
    const command_t* const c = subordinate_.command();
    const double time_s = seconds(cycle.now - sim::Simulator::kStart);
    const Pose T = simulator_.vehicle().pose_at(time_s);
    const bool wanted = c != nullptr && subordinate_.valid(cycle.now);
    std::optional<Vec3> goal;
    while (wanted && next_ < c->waypoint.size()) {
      const waypoint_t& w = c->waypoint[next_];
      const Vec3 p_vehicle = T.inverse() * from_message(w.p_m);
      if (p_vehicle.head<2>().norm() > 0.8 * w.radius_m) {
        goal = p_vehicle;
        break;
      }
      ++next_;
    }
    drive_t m{};
    m.utime = to_utime(cycle.now);
    m.valid_until_utime = to_utime(cycle.now + from_seconds(0.3));
    if (goal) {
      const double curvature = 2.0 * goal->y() / goal->head<2>().squaredNorm();
      m.curvature_1pm = std::clamp(curvature, -0.2, 0.2);
      m.speed_mps = std::abs(m.curvature_1pm) > 0.05 ? 2.5 : c->waypoint[next_].speed_mps;
    }
    drive_.publish(&m);
    const bool done = wanted && next_ == c->waypoint.size();
    StatusReport report;
    report.status = done     ? status_t::STATUS_DONE
                    : wanted ? status_t::STATUS_EXEC
                             : status_t::STATUS_UNINITIALIZED;
    report.state = done ? "ARRIVED" : "DRIVING";
    report.waypoints_done = static_cast<int>(next_);
    subordinate_.report(cycle.now, report);
  }

 private:
  const sim::Simulator& simulator_;
  NodeInfo info_{"bg", from_milliseconds(40.0), from_milliseconds(1.0)};
  PeriodicClock clock_{from_milliseconds(50.0)};
  Subordinate subordinate_;
  Outbox<drive_t> drive_;
  std::size_t next_ = 0;
};

sim::Scenario scenario(std::int64_t seed) {
  sim::ScenarioOverrides overrides;
  overrides.seed = seed;
  const Result<sim::Scenario> s =
      sim::load_scenario(source_path("config/sim/closed_loop.toml"), overrides);
  RCS_CHECK(s.ok());
  return *s;
}

driving::ClosedLoopRun cheat(const sim::Scenario& s) {
  driving::ClosedLoopOptions options;
  options.vehicle_config = source_path("config/demo3.toml");
  return driving::run_closed_loop(
      s, options,
      [](const ParamFile&, Bus* bus, const sim::Simulator& sim) -> std::unique_ptr<Node> {
        return std::make_unique<Cheat>(bus, sim);
      });
}

TEST(ClosedLoop, ADriverThatUsesGroundTruthReachesEveryWaypointRepeatably) {
  const sim::Scenario s = scenario(1);
  const driving::ClosedLoopRun a = cheat(s);
  std::printf("%s", describe(a).c_str());
  ASSERT_EQ(a.config_error, "");
  EXPECT_TRUE(a.done) << a.reason;
  EXPECT_EQ(a.reached, 5);
  EXPECT_NEAR(a.fastest_mps, 6.0, 0.3);
  EXPECT_GT(a.distance_m, 5 * 35.0);
  EXPECT_EQ(a.drive.implausible + a.drive.stale + a.drive.expired + a.drive.silences, 0);
  EXPECT_FALSE(a.fenced);
  EXPECT_LT(a.worst_error_m, 2.0);
  ASSERT_GT(a.trace.size(), 300U);
  EXPECT_TRUE(a.trace.back().gps);

  const std::string picture = draw(a, s, "a <test>");
  EXPECT_EQ(picture.rfind("<svg", 0), 0U);
  EXPECT_NE(picture.find("a &lt;test&gt;"), std::string::npos);
  EXPECT_EQ(picture.find("nan"), std::string::npos);
  EXPECT_LT(picture.size(), 500'000U);

  const driving::ClosedLoopRun b = cheat(s);
  ASSERT_EQ(a.trace.size(), b.trace.size());
  EXPECT_EQ(a.trace.back().T_world_vehicle.p, b.trace.back().T_world_vehicle.p);
  EXPECT_EQ(a.trace.back().T_world_estimated.p, b.trace.back().T_world_estimated.p);
}

TEST(ClosedLoop, GroundTruthReportsGpsOutagesAndCollisions) {
  sim::Scenario s = scenario(2);
  s.gps.lost_after_m = 50.0;
  s.world.rocks.per_m2 = 0.2;  // a driver without obstacle avoidance hits something
  s.ladar = sim::LadarKind::kNone;
  const driving::ClosedLoopRun run = cheat(s);
  std::printf("%s", describe(run).c_str());
  EXPECT_TRUE(run.done) << run.reason;
  EXPECT_GT(run.collisions, 0);
  EXPECT_LT(run.min_clearance_m, 0.0);
  double way_m = 0.0;
  for (std::size_t k = 1; k < run.trace.size(); ++k) {
    way_m += (run.trace[k].T_world_vehicle.p - run.trace[k - 1].T_world_vehicle.p).norm();
    if (way_m > 60.0) {
      EXPECT_FALSE(run.trace[k].gps);
    }
  }
}

}  // namespace
}  // namespace rcs::test

// SP under load, in lockstep: the degrade level rises before a deadline is missed and returns, no
// scan is unaccounted for, and the run is repeatable to the byte.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/executor.h"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "sim/scenario_file.h"
#include "sim/simulator.h"

namespace rcs::test {
namespace {

constexpr double kDuration_s = 12.0;

/// Compute time of a cycle that completes a scan, as a function of the time and of the level of the
/// scan before.
using Cost = std::function<Duration(Stamp, int level)>;

/// SP on a computer of varying speed.
class Slowed final : public Node {
 public:
  Slowed(Node* node, Cost cost) : node_(node), cost_(std::move(cost)) {}

  [[nodiscard]] const NodeInfo& info() const override { return node_->info(); }
  [[nodiscard]] Stamp next_wakeup() const override { return node_->next_wakeup(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return node_->inboxes(); }
  [[nodiscard]] Duration nominal_compute() const override {
    const bool ends_scan = node_->nominal_compute() > Duration::zero();
    return ends_scan ? cost_(node_->next_wakeup(), node_->degrade_level()) : Duration::zero();
  }
  void run(const Cycle& cycle) override { node_->run(cycle); }

 private:
  Node* node_;
  Cost cost_;
};

/// All messages of SP and WM.
class Recorder final : public BusTap {
 public:
  void on_deliver(Stamp /*due*/, std::string_view name, const std::uint8_t* data,
                  std::size_t size) override {
    const bool ours = name.substr(0, 3) == "SP_" || name.substr(0, 3) == "WM_";
    if (!ours) return;
    bytes.append(reinterpret_cast<const char*>(data), size);
    registration_t m{};
    if (name == channel::kSpRegistration && m.decode(data, 0, static_cast<int>(size)) > 0) {
      if (m.target == registration_t::TARGET_PRIOR_MAP) prior_scans.insert(m.scan_id);
      if (m.target == registration_t::TARGET_ROLLING) registrations.push_back(m);
    }
    nav_state_t s{};
    if (name == channel::kWmNavState && s.decode(data, 0, static_cast<int>(size)) > 0) {
      beliefs.push_back(s);
    }
  }

  std::string bytes;
  std::vector<registration_t> registrations;
  std::vector<nav_state_t> beliefs;
  std::set<std::int64_t> prior_scans;
};

struct Outcomes {
  Recorder said;
  std::int64_t overruns = 0;  // of sp

  [[nodiscard]] int highest_level() const {
    int level = 0;
    for (const registration_t& m : said.registrations) {
      level = std::max<int>(level, m.degrade_level);
    }
    return level;
  }
};

std::string source_path(const std::string& relative) {
  const char* root = std::getenv("RCS_SOURCE_DIR");
  return std::string(root == nullptr ? "." : root) + "/" + relative;
}

Outcomes drive(const Cost& cost, double nominal_unit_ns) {
  sim::ScenarioOverrides overrides;
  overrides.duration_s = kDuration_s;
  const Result<sim::Scenario> scenario =
      sim::load_scenario(source_path("config/sim/reference.toml"), overrides);
  RCS_CHECK(scenario.ok());
  const Result<ParamFile> file = ParamFile::load(source_path("config/demo3.toml"));
  RCS_CHECK(file.ok());
  Result<sp::SpConfig> sp_config = sp::load_sp_config(*file);
  const Result<wm::WmConfig> wm_config = wm::load_wm_config(*file);
  RCS_CHECK(sp_config.ok() && wm_config.ok());
  sp_config->grant.nominal_unit_ns = nominal_unit_ns;

  sim::Simulator simulator(*scenario);
  const sim::PriorMap survey = simulator.prior_map();
  Result<ElevationMap> map = ElevationMap::from_rasters(survey.frame, {survey.raster});
  RCS_CHECK(map.ok());
  LocalBus bus;
  Outcomes out;
  bus.set_tap(&out.said);
  sp::SpNode sp_node(*sp_config, PriorTerrain(std::move(map).value(), nullptr), &bus);
  wm::WmNode wm_node(*wm_config, &bus);
  Slowed slowed(&sp_node, cost);
  LockstepTimeline timeline(&bus, &simulator, from_seconds(0.5));
  const RunReport report = run({&slowed, &wm_node}, timeline, nullptr);
  out.overruns = report.nodes.front().overruns;
  return out;
}

Duration ms(double n) { return from_milliseconds(n); }

Cost always(double n) {
  return [n](Stamp, int) { return ms(n); };
}

bool within(Stamp t, double from_s, double to_s) {
  const double s = seconds(t - sim::Simulator::kStart);
  return s >= from_s && s < to_s;
}

/// The first scan after 5 s takes a long time.
Cost one_stall(double n) {
  return [n, stalled = false](Stamp t, int) mutable {
    const bool now = !stalled && within(t, 5.0, kDuration_s);
    stalled = stalled || now;
    return ms(now ? n : 8.0);
  };
}

/// Each scan between the first and the last has a result or is counted as dropped, none twice.
void expect_every_scan_accounted_for(const std::vector<registration_t>& answers) {
  ASSERT_FALSE(answers.empty());
  std::set<std::int64_t> numbers;
  std::int64_t held = 0;
  std::int64_t degraded = 0;
  for (const registration_t& m : answers) {
    EXPECT_TRUE(numbers.insert(m.scan_id).second) << m.scan_id;
    EXPECT_EQ(m.stop == registration_t::STOP_HELD, m.degrade_level == 3) << m.scan_id;
    held += m.degrade_level == 3 ? 1 : 0;
    degraded += m.degrade_level == 1 || m.degrade_level == 2 ? 1 : 0;
  }
  const scan_account_t& account = answers.back().account;
  EXPECT_EQ(account.answered, static_cast<std::int64_t>(answers.size()));
  EXPECT_EQ(account.held, held);
  EXPECT_EQ(account.degraded, degraded);
  EXPECT_EQ(account.answered + account.dropped, *numbers.rbegin() - *numbers.begin() + 1);
}

TEST(Degrade, ANormalReplayOmitsNothingAndHasCompleteLatencyTraces) {
  const Outcomes out = drive(always(8.0), 100.0);
  EXPECT_EQ(out.highest_level(), 0);
  EXPECT_EQ(out.overruns, 0);
  expect_every_scan_accounted_for(out.said.registrations);
  EXPECT_GT(out.said.registrations.size(), 100U);
  EXPECT_GT(out.said.prior_scans.size(), 50U);
  for (const registration_t& m : out.said.registrations) {
    EXPECT_GE(m.latency_trace.measured_utime, m.utime);
    EXPECT_LE(m.latency_trace.measured_utime - m.utime, 30000);
    EXPECT_LT(m.latency_trace.first_facet_utime, m.latency_trace.last_facet_utime);
    EXPECT_LE(m.latency_trace.last_facet_utime, m.latency_trace.sp_start_utime);
    EXPECT_EQ(m.latency_trace.wm_arrival_utime, 0);
  }
  std::int64_t last_scan = 0;
  for (const nav_state_t& m : out.said.beliefs) {
    if (m.latency_trace.measured_utime <= last_scan) continue;
    last_scan = m.latency_trace.measured_utime;
    // In lockstep the work and the hop are the nominal compute time, to the microsecond.
    EXPECT_EQ(m.latency_trace.wm_arrival_utime - m.latency_trace.sp_start_utime, 8000);
    EXPECT_LE(m.latency_trace.wm_arrival_utime, m.latency_trace.wm_start_utime);
    EXPECT_LE(m.latency_trace.wm_start_utime, m.publish_utime);
  }
  EXPECT_GT(last_scan, 0);
}

TEST(Degrade, SlowProcessingDegradesBeforeADeadlineIsMissedAndRecovers) {
  const Cost cost = [](Stamp t, int level) {
    if (!within(t, 4.0, 7.0)) return ms(8.0);
    return level == 0 ? ms(76.0) : ms(35.0);
  };
  const Outcomes out = drive(cost, 100.0);
  EXPECT_GE(out.highest_level(), 1);
  EXPECT_EQ(out.overruns, 0);
  EXPECT_EQ(out.said.registrations.back().degrade_level, 0);
  EXPECT_EQ(out.said.registrations.back().account.held, 0);
  EXPECT_EQ(out.said.registrations.back().account.failed, 0);
  expect_every_scan_accounted_for(out.said.registrations);
  const Outcomes again = drive(cost, 100.0);
  EXPECT_TRUE(out.said.bytes == again.said.bytes);
}

TEST(Degrade, AfterAStallTheStaleScanIsHeldAndTheNewestIsRegistered) {
  const Outcomes out = drive(one_stall(160.0), 100.0);
  const std::vector<registration_t>& answers = out.said.registrations;
  expect_every_scan_accounted_for(answers);
  EXPECT_EQ(answers.back().account.held, 1);
  EXPECT_EQ(answers.back().account.dropped, 0);
  EXPECT_EQ(answers.back().degrade_level, 0);
  const auto held = std::find_if(answers.begin(), answers.end(),
                                 [](const registration_t& m) { return m.degrade_level == 3; });
  ASSERT_NE(held, answers.end());
  EXPECT_EQ(held->points, 0);
  for (const auto& row : held->information) {
    for (const double v : row) EXPECT_EQ(v, 0.0);
  }
  const registration_t& next = *(held + 1);
  EXPECT_EQ(next.degrade_level, 2);
  EXPECT_NE(next.stop, held->stop);
  EXPECT_EQ(out.said.prior_scans.count(next.scan_id), 0U) << "level 2: no a priori match";
  // The pose of the vehicle is known nevertheless, and no result of the held scan is used.
  for (const nav_state_t& m : out.said.beliefs) {
    EXPECT_NE(m.latency_trace.measured_utime, held->latency_trace.measured_utime);
  }
}

TEST(Degrade, ScansLostInALongStallAreCounted) {
  const Outcomes out = drive(one_stall(900.0), 100.0);
  expect_every_scan_accounted_for(out.said.registrations);
  const registration_t& last = out.said.registrations.back();
  EXPECT_GT(last.account.dropped, 0) << "inboxes keep three scans";
  EXPECT_GT(last.account.held, 0);
  EXPECT_EQ(last.degrade_level, 0);
}

TEST(Degrade, WithAQuarterOfTheGrantFewerPointsAreRegisteredWithinIt) {
  // The cost of a unit is so high that the slack covers little more than the nominal need of a full
  // scan.
  const Outcomes enough = drive(always(8.0), 400.0);
  EXPECT_EQ(enough.highest_level(), 0);
  const Outcomes quarter = drive(always(8.0), 1600.0);
  EXPECT_GE(quarter.highest_level(), 1);
  const scan_account_t& account = quarter.said.registrations.back().account;
  EXPECT_GT(account.degraded, account.answered / 2);
  EXPECT_EQ(account.failed, 0);
  EXPECT_EQ(account.held, 0);
  expect_every_scan_accounted_for(quarter.said.registrations);
  for (const registration_t& m : quarter.said.registrations) {
    EXPECT_LE(m.used_units, m.granted_units);
  }
}

}  // namespace
}  // namespace rcs::test

// BG in the closed loop: invariants that hold during disturbances of the drive.

#include <gtest/gtest.h>

#include <cstdio>
#include <deque>
#include <optional>

#include "modules/bg/bg_node.h"
#include "sim/scenario_file.h"
#include "tests/replay/chain.h"
#include "tests/support/heap_guard.h"
#include "tools/driving/closed_loop.h"

namespace rcs::test {
namespace {

/// BG, monitored and restarted at given moments: its process dies and another one replaces it.
class WatchedBg final : public Node {
 public:
  struct Account {
    std::int64_t cycles = 0;
    std::int64_t allocations = 0;  // after warm-up
    std::int64_t last_cycle = 0;   // that allocated
  };
  WatchedBg(const ParamFile& file, Bus* bus, std::deque<Stamp> deaths, Account* account)
      : file_(&file), bus_(bus), deaths_(std::move(deaths)), account_(account) {
    start();
  }

  [[nodiscard]] const NodeInfo& info() const override { return node_->info(); }
  [[nodiscard]] Stamp next_wakeup() const override { return node_->next_wakeup(); }
  [[nodiscard]] Duration nominal_compute() const override { return node_->nominal_compute(); }
  [[nodiscard]] std::vector<const InboxBase*> inboxes() const override { return node_->inboxes(); }

  void run(const Cycle& cycle) override {
    if (!deaths_.empty() && cycle.now >= deaths_.front()) {
      deaths_.pop_front();
      start();
    }
    const HeapGuard guard;
    node_->run(cycle);
    constexpr std::int64_t kWarmUp = 400;  // 20 s: 15 s of them driving
    if (++account_->cycles <= kWarmUp || guard.allocations() == 0) return;
    account_->allocations += guard.allocations();
    account_->last_cycle = account_->cycles;
  }

 private:
  void start() {
    Result<std::unique_ptr<Node>> node = bg::make_bg_node(*file_, bus_);
    RCS_CHECK(node.ok());
    if (node_ != nullptr) dead_.push_back(std::move(node_));  // the bus still refers to its inboxes
    node_ = std::move(node).value();
  }

  const ParamFile* file_;
  Bus* bus_;
  std::deque<Stamp> deaths_;
  Account* account_;
  std::unique_ptr<Node> node_;
  std::deque<std::unique_ptr<Node>> dead_;
};

driving::ClosedLoopRun drive(const std::deque<Stamp>& deaths, WatchedBg::Account* account) {
  const Result<sim::Scenario> scenario =
      sim::load_scenario(source_path("config/sim/closed_loop.toml"), {});
  RCS_CHECK(scenario.ok());
  driving::ClosedLoopOptions options;
  options.vehicle_config = source_path("config/demo3.toml");
  return driving::run_closed_loop(
      *scenario, options,
      [&](const ParamFile& file, Bus* bus, const sim::Simulator&) -> std::unique_ptr<Node> {
        return std::make_unique<WatchedBg>(file, bus, deaths, account);
      });
}

TEST(Drive, CyclesOfBgAllocateNothingAfterWarmUp) {
  if (!HeapGuard::available()) GTEST_SKIP() << "SKIPPED: a sanitizer owns malloc";
  WatchedBg::Account account;
  const driving::ClosedLoopRun run = drive({}, &account);
  std::printf("%s", describe(run).c_str());
  EXPECT_TRUE(run.done) << run.reason;
  EXPECT_EQ(run.collisions, 0);
  EXPECT_GT(account.cycles, 1000);
  EXPECT_EQ(account.allocations, 0) << "last in cycle " << account.last_cycle;
}

// The superior keeps the progress of its task: no waypoint is driven to twice.
TEST(Drive, ARestartedBgContinuesTheTask) {
  WatchedBg::Account account;
  const auto at = [](double s) { return sim::Simulator::kStart + from_seconds(s); };
  const driving::ClosedLoopRun run = drive({at(25.0), at(40.0), at(41.0), at(55.0)}, &account);
  std::printf("%s", describe(run).c_str());
  EXPECT_TRUE(run.done) << run.reason;
  EXPECT_EQ(run.reached, 5);
  EXPECT_EQ(run.collisions, 0);
  // Without the memory of the ground another way may be found, and of another length.
  std::size_t next = 0;
  for (const driving::ClosedLoopSample& sample : run.trace) {
    const Vec2 here = sample.T_world_vehicle.p.head<2>();
    const auto away_m = [&](std::size_t k) { return (here - run.waypoints_world[k]).norm(); };
    if (next < run.waypoints_world.size() && away_m(next) < 3.0) ++next;
    if (next > 1) {
      EXPECT_GT(away_m(next - 2), 3.0) << "again at waypoint " << next - 1;
    }
  }
  EXPECT_EQ(next, 5U);
}

}  // namespace
}  // namespace rcs::test

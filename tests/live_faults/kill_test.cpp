// kill -9, SIGSTOP for 3 s, a restart, no more memory and no more descriptors for each node,
// repeatedly, while the vehicle drives: it is always stopped or driving safely, the run recovers by
// itself, and nothing is counted twice.
// RCS_DRILL_TIMES: repetitions for each node, default 30.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "tests/live_faults/live_fault.h"
#include "tools/base/statistics.h"
#include "tools/report/table.h"

namespace rcs::live_faults {
namespace {

constexpr Duration kStopped = from_seconds(3.0);
constexpr Duration kPatience = from_seconds(60.0);
/// `rcs up` restarts a node that lived for less than half a minute after increasingly long waits.
/// The tests of the supervisor cover that; here each exit counts as the first one.
constexpr Duration kHealthy = from_seconds(31.0);

enum class Kind { kKill, kStop, kRestart, kMemory, kDescriptors };

bool ends_process(Kind kind) { return kind == Kind::kKill || kind == Kind::kRestart; }

/// Of a running process: it gets no more memory than it has, or no more descriptors.
void limit(int pid, Kind kind) {
  rlimit none{};
  if (kind == Kind::kDescriptors) {
    none.rlim_cur = none.rlim_max = 3;
    EXPECT_EQ(prlimit(pid, RLIMIT_NOFILE, &none, nullptr), 0);
    return;
  }
  std::ifstream statm("/proc/" + std::to_string(pid) + "/statm");
  rlim_t pages = 0;
  statm >> pages;
  none.rlim_cur = none.rlim_max = pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE));
  EXPECT_EQ(prlimit(pid, RLIMIT_AS, &none, nullptr), 0);
}

/// Results of one kind of disturbance of one node.
struct Outcomes {
  int times = 0;
  std::vector<double> recovery_s;  ///< from the signal; of a stop: from SIGCONT
  int ended = 0;                   ///< without memory
  SafetyMetrics worst;
};

class KillDrill : public testing::Test {
 protected:
  void run(Kind kind) {
    const int times = number_from("RCS_DRILL_TIMES", 30);
    ASSERT_EQ(drill_.run.trouble(), "");
    drill_.run.record();
    ASSERT_TRUE(drill_.run_until_well(kPatience)) << why();
    for (int i = 0; i < times; ++i) {
      for (const std::string& node : kNodes) {
        wait_until_healthy(node, kind);
        disturb(node, kind);
        if (!drill_.run.trouble().empty()) break;
      }
    }
    judge(times);
  }

 private:
  /// At varying moments of a cycle and at varying positions of the course.
  void wait_until_healthy(const std::string& node, Kind kind) {
    std::uniform_real_distribution<double> pause_s(0.5, 2.5);
    drill_.run_for(from_seconds(pause_s(random_)));
    if (!ends_process(kind) && kind != Kind::kMemory) return;
    const Stamp healthy = drill_.run.received_first(node) + kHealthy;
    if (healthy > drill_.run.now()) (void)drill_.run.run_until(healthy, {});
  }

  void disturb(const std::string& node, Kind kind) {
    // The course may have just ended; the vehicle must be driving.
    drill_.recovery.reset();
    EXPECT_TRUE(drill_.run_until_well(kPatience)) << "before " << node << ": " << why();
    if (!drill_.run.trouble().empty()) return;
    drill_.safety.reset();
    const int pid = drill_.run.pid_of(node);
    Outcomes& outcomes = outcomes_[node];
    ++outcomes.times;
    if (kind == Kind::kStop) {
      drill_.run.send_signal(node, SIGSTOP);
      drill_.run_for(kStopped);
      drill_.run.send_signal(node, SIGCONT);
    } else if (!ends_process(kind)) {
      limit(pid, kind);
      drill_.run_for(kStopped);
    } else {
      drill_.run.send_signal(node, kind == Kind::kKill ? SIGKILL : SIGTERM);
    }
    const Stamp begin = drill_.run.now();
    if (ends_process(kind)) {
      // Messages that the process still publishes while it ends are no sign of recovery.
      const auto another = [&] { return drill_.run.pid_of(node) != pid; };
      EXPECT_TRUE(drill_.run.run_until(begin + kPatience, another)) << node << " is not back";
    }
    drill_.recovery.reset();
    if (drill_.run_until_well(kPatience)) {
      outcomes.recovery_s.push_back(seconds(*drill_.recovery.recovered() - begin));
    } else {
      ADD_FAILURE() << node << ", time " << outcomes.times << ": not recovered: " << why();
    }
    if (kind == Kind::kMemory) {  // it may end, and then is started again
      if (drill_.run.pid_of(node) != pid) ++outcomes.ended;
    } else {
      EXPECT_EQ(drill_.run.pid_of(node) == pid, !ends_process(kind)) << node;
    }
    add(drill_.safety.metrics(), &outcomes.worst);
    std::fprintf(stderr, "%-8s %2d: %.1f s, %.2f m\n", node.c_str(), outcomes.times,
                 outcomes.recovery_s.empty() ? -1.0 : outcomes.recovery_s.back(),
                 drill_.safety.metrics().clearance_m);
  }

  static void add(const SafetyMetrics& one, SafetyMetrics* all) {
    all->collisions += one.collisions;
    all->clearance_m = std::min(all->clearance_m, one.clearance_m);
    all->speed_mps = std::max(all->speed_mps, one.speed_mps);
    all->deceleration_mps2 = std::max(all->deceleration_mps2, one.deceleration_mps2);
    all->lateral_mps2 = std::max(all->lateral_mps2, one.lateral_mps2);
  }

  void judge(int times) {
    report::Table table;
    table.header = {"node",       "times",       "recovered",   "median s",     "max s",
                    "collisions", "clearance m", "brakes m/s2", "lateral m/s2", "speed m/s"};
    for (const std::string& node : kNodes) {
      const Outcomes& o = outcomes_[node];
      const tools::Summary s = tools::summarize(o.recovery_s);
      table.rows.push_back(
          {node, std::to_string(o.times), std::to_string(o.recovery_s.size()),
           fmt::format("{:.1f}", s.p50), fmt::format("{:.1f}", s.max),
           std::to_string(o.worst.collisions), fmt::format("{:.2f}", o.worst.clearance_m),
           fmt::format("{:.1f}", o.worst.deceleration_mps2),
           fmt::format("{:.1f}", o.worst.lateral_mps2), fmt::format("{:.1f}", o.worst.speed_mps)});
      EXPECT_EQ(o.times, times) << node;
      EXPECT_EQ(o.recovery_s.size(), static_cast<std::size_t>(times)) << node;
    }
    const std::string sim = drill_.run.end();
    std::printf(
        "%s%lld scans, %lld commands, %lld waypoints (%lld times back to one), %d courses begun; "
        "the operator gave up %zu times\n%s\n",
        report::to_text(table).c_str(), static_cast<long long>(drill_.counts.scans()),
        static_cast<long long>(drill_.counts.commands()),
        static_cast<long long>(drill_.counts.waypoints()),
        static_cast<long long>(drill_.counts.returns()), drill_.run.courses(),
        drill_.run.gave_up().size(), sim.c_str());
    for (const std::string& reason : drill_.run.gave_up()) std::printf("  %s\n", reason.c_str());
    EXPECT_EQ(drill_.run.trouble(), "");
    EXPECT_EQ(drill_.breaches(), "");
  }

  std::string why() {
    std::string text = drill_.recovery.missing() + "; " + drill_.run.trouble() + "\n";
    for (const std::string& e : drill_.events) text += "  " + e + "\n";
    return text;
  }

  LiveFault drill_;
  std::map<std::string, Outcomes> outcomes_;
  std::mt19937 random_{1};
};

TEST_F(KillDrill, Kill9) { run(Kind::kKill); }
TEST_F(KillDrill, StopForThreeSeconds) { run(Kind::kStop); }
TEST_F(KillDrill, Restart) { run(Kind::kRestart); }
TEST_F(KillDrill, NoMoreMemory) { run(Kind::kMemory); }
TEST_F(KillDrill, NoMoreDescriptors) { run(Kind::kDescriptors); }

}  // namespace
}  // namespace rcs::live_faults

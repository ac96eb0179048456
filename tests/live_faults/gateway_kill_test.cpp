// A DDS program and the gateway are killed repeatedly: no cycle of another node and no scan latency
// becomes longer. The values are printed and not checked against limits, since the computer is not
// quiet.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cstdio>
#include <string>

#include "lcmtypes/rcs/ladar_ranges_t.hpp"
#include "rcs/node/report.h"
#include "tests/live_faults/live_fault.h"
#include "tools/base/statistics.h"
#include "tools/evaluation/latency_trace.h"
#include "tools/report/table.h"

namespace rcs::live_faults {
namespace {

using evaluation::BudgetRecord;
using evaluation::ScanLatencyTrace;
using evaluation::values_of;

constexpr Duration kPatience = from_seconds(60.0);
constexpr Duration kBetweenKills = from_seconds(2.0);
/// For the results of the last scan, and for the scan that was half sent when recording began.
constexpr Duration kTail = from_seconds(0.5);

/// Statistics of a part of the drive, from the messages on the bus.
class Books {
 public:
  explicit Books(Bus* bus)
      : ranges_(bus, channel::kLadarRanges,
                [this](const ladar_ranges_t& m, Stamp arrival) {
                  // A scan that began earlier is not counted.
                  if (m.facet == 0 && open_) scan_ = m.scan_id;
                  if (m.scan_id == scan_) latency_trace_.sent(m.reference_utime, arrival);
                }),
        registrations_(bus, channel::kSpRegistration,
                       [this](const registration_t& m, Stamp) { latency_trace_.accept(m); }),
        nav_states_(bus, channel::kWmNavState,
                    [this](const nav_state_t& m, Stamp) { latency_trace_.accept(m); }),
        drives_(bus, channel::kBgDrive,
                [this](const drive_t& m, Stamp) { latency_trace_.accept(m); }) {
    for (const char* node : {"sp", "wm", "bg"}) {
      cycles_.emplace_back(bus, channel_of(node, "CYCLE"),
                           [this](const cycle_t& m, Stamp) { latency_trace_.accept(m); });
    }
  }

  void open() {
    latency_trace_ = {};
    scan_ = -1;
    open_ = true;
  }
  void no_more_scans() { open_ = false; }
  [[nodiscard]] evaluation::BudgetRecord close() const { return latency_trace_.close(); }

 private:
  evaluation::ScanLatencyTrace latency_trace_;
  std::int64_t scan_ = -1;  // in progress
  bool open_ = false;
  Tap<ladar_ranges_t> ranges_;
  Tap<registration_t> registrations_;
  Tap<nav_state_t> nav_states_;
  Tap<drive_t> drives_;
  std::deque<Tap<cycle_t>> cycles_;
};

std::vector<std::string> row(const std::string& name, const std::vector<double>& before,
                             const std::vector<double>& during) {
  std::vector<std::string> cells = {name};
  for (const std::vector<double>* values : {&before, &during}) {
    const tools::Summary s = tools::summarize(*values);
    for (const double ms : {s.p50, s.p99, s.max}) cells.push_back(fmt::format("{:.2f}", ms));
  }
  return cells;
}

TEST(GatewayKillDrill, NoCycleTakesLongerWhenTheGatewayIsKilled) {
  const Duration window = std::chrono::seconds(number_from("RCS_DRILL_SECONDS", 60));
  LiveFault drill;
  ASSERT_EQ(drill.run.trouble(), "");
  Books books(drill.run.bus());
  drill.run.keep_client();
  ASSERT_TRUE(drill.run_until_well(kPatience)) << drill.recovery.missing();

  books.open();
  drill.run_for(window);
  books.no_more_scans();
  drill.run_for(kTail);
  const evaluation::BudgetRecord before = books.close();

  books.open();
  int gateways = 0;
  int clients = 0;
  const Stamp end = drill.run.now() + window;
  int killed = 0;  // pid of the newest gateway: its successor may wait for the supervisor
  for (bool client = true; drill.run.now() < end && drill.run.trouble().empty(); client = !client) {
    drill.run_for(kBetweenKills);
    if (client) {
      drill.run.kill_client();
      ++clients;
    } else if (drill.run.pid_of("gateway") != killed) {
      killed = drill.run.pid_of("gateway");
      drill.run.send_signal("gateway", SIGKILL);
      ++gateways;
    }
  }
  books.no_more_scans();
  drill.run_for(kTail);
  const evaluation::BudgetRecord during = books.close();

  report::Table table;
  table.header = {"ms", "before p50", "p99", "max", "during p50", "p99", "max"};
  for (const char* name :
       {"sp", "wm", "bg", "sp: CPU", "wm: CPU", "bg: CPU", "sp: late", "wm: late", "bg: late"}) {
    table.rows.push_back(row(name, evaluation::values_of(before.stages, name),
                             evaluation::values_of(during.stages, name)));
  }
  for (const char* name : {evaluation::kToNavState, evaluation::kToDrive}) {
    table.rows.push_back(row(name, evaluation::values_of(before.hops, name),
                             evaluation::values_of(during.hops, name)));
  }
  std::printf("the gateway was killed %d times, its client %d times\n%s", gateways, clients,
              report::to_text(table).c_str());
  for (const evaluation::BudgetRecord* record : {&before, &during}) {
    const evaluation::ScanCounts& s = record->scans;
    std::printf(
        "%s: %lld scans: %lld full, %lld degraded, %lld held, %lld failed, %lld dropped, "
        "%lld unaccounted\n",
        record == &before ? "before" : "during", static_cast<long long>(s.sent),
        static_cast<long long>(s.full), static_cast<long long>(s.degraded),
        static_cast<long long>(s.held), static_cast<long long>(s.failed),
        static_cast<long long>(s.dropped), static_cast<long long>(s.unaccounted));
    EXPECT_GE(s.sent, 9 * std::chrono::duration_cast<std::chrono::seconds>(window).count());
    EXPECT_EQ(s.dropped + s.unaccounted, 0);
  }
  EXPECT_GE(gateways, 1);
  EXPECT_GE(clients, 1);
  (void)drill.run.end();
  EXPECT_EQ(drill.run.trouble(), "");
  EXPECT_EQ(drill.breaches(), "");
}

}  // namespace
}  // namespace rcs::live_faults

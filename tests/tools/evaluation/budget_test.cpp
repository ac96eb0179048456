// Statistics of a budget run: every scan has an outcome, every hop is found, limits are checked.

#include <gtest/gtest.h>

#include <numeric>

#include "tools/evaluation/budget_metrics.h"

namespace rcs::evaluation {
namespace {

constexpr std::int64_t kPeriod_us = 100'000;

std::int64_t reference(int scan) { return 5'000'000 + scan * kPeriod_us; }
/// Node time: a different clock.
std::int64_t at(int scan, std::int64_t us) { return 77'000'000 + scan * kPeriod_us + us; }

latency_trace_t latency_trace(int scan) {
  latency_trace_t l{};
  l.measured_utime = reference(scan);
  l.first_facet_utime = at(scan, -90'000);
  l.last_facet_utime = at(scan, 200);
  l.sp_start_utime = at(scan, 300);
  return l;
}

registration_t answer(int scan, int stop, int level, std::int64_t answered) {
  registration_t m{};
  m.utime = reference(scan);
  m.target = registration_t::TARGET_ROLLING;
  m.stop = static_cast<std::int8_t>(stop);
  m.degrade_level = static_cast<std::int8_t>(level);
  m.latency_trace = latency_trace(scan);
  m.account.answered = answered;
  return m;
}

cycle_t cycle(const std::string& node, std::int64_t start, std::int64_t wall_us) {
  cycle_t m{};
  m.node = node;
  m.utime = start;
  m.used_wall_us = wall_us;
  return m;
}

std::int64_t sum(const ScanCounts& c) {
  return c.full + c.degraded + c.held + c.failed + c.dropped + c.unaccounted;
}

TEST(ScanLatencyTrace, EveryScanHasExactlyOneOutcome) {
  ScanLatencyTrace books;
  for (int scan = 0; scan < 8; ++scan) books.sent(reference(scan), from_utime(at(scan, 0)));
  books.accept(answer(0, registration_t::STOP_SEEDED, 0, 1));
  books.accept(answer(1, registration_t::STOP_CONVERGED, 1, 2));
  books.accept(answer(2, registration_t::STOP_HELD, 3, 3));
  books.accept(answer(3, registration_t::STOP_TOO_FEW, 0, 4));
  // A new map after the failure: no second result.
  books.accept(answer(3, registration_t::STOP_SEEDED, 0, 4));
  // Scan 4 is dropped, the result of scan 5 is lost, and scan 7 is unaccounted for.
  registration_t last = answer(6, registration_t::STOP_CONVERGED, 0, 6);
  last.account.dropped = 1;
  books.accept(last);
  const ScanCounts c = books.close().scans;
  EXPECT_EQ(c.sent, 8);
  EXPECT_EQ(c.full, 3);  // 0, 6 and the lost 5
  EXPECT_EQ(c.not_received, 1);
  EXPECT_EQ(c.degraded, 1);
  EXPECT_EQ(c.held, 1);
  EXPECT_EQ(c.failed, 1);
  EXPECT_EQ(c.dropped, 1);
  EXPECT_EQ(c.unaccounted, 1);
  EXPECT_EQ(sum(c), c.sent);
}

TEST(ScanLatencyTrace, TheHopsAddUpToTheChain) {
  ScanLatencyTrace books;
  books.sent(reference(0), from_utime(at(0, -6'000)));
  books.sent(reference(0), from_utime(at(0, 0)));
  registration_t m = answer(0, registration_t::STOP_CONVERGED, 0, 1);
  books.accept(m);
  cycle_t sp = cycle("sp", at(0, 300), 9'000);
  sp.stage = {{"convert", 700}, {"deskew", 100}, {"register", 4'900}, {"map", 3'300}};
  sp.n_stages = 4;
  books.accept(sp);
  nav_state_t nav{};
  nav.latency_trace = m.latency_trace;
  nav.latency_trace.wm_arrival_utime = at(0, 5'500);
  nav.latency_trace.wm_start_utime = at(0, 5'600);
  books.accept(nav);
  books.accept(cycle("wm", at(0, 5'600), 150));
  drive_t drive{};
  drive.latency_trace = nav.latency_trace;
  drive.latency_trace.bg_arrival_utime = at(0, 5'950);
  drive.latency_trace.bg_start_utime = at(0, 30'000);
  books.accept(drive);
  books.accept(cycle("bg", at(0, 30'000), 1'000));

  const BudgetRecord record = books.close();
  const auto only = [&](const char* name) {
    const std::vector<double>& values = values_of(record.hops, name);
    EXPECT_EQ(values.size(), 1U) << name;
    return values.empty() ? -1.0 : values.front();
  };
  EXPECT_DOUBLE_EQ(only("last facet sent -> arrival in sp"), 0.2);
  EXPECT_DOUBLE_EQ(only("sp: last facet -> start"), 0.1);
  EXPECT_DOUBLE_EQ(only(kSpWork), 5.0) << "without the facets before and the map after";
  EXPECT_DOUBLE_EQ(only("hop sp -> wm"), 0.2);
  EXPECT_DOUBLE_EQ(only("wm: arrival -> start"), 0.1);
  EXPECT_DOUBLE_EQ(only("wm: work"), 0.15);
  EXPECT_DOUBLE_EQ(only(kToNavState), 5.75);
  EXPECT_DOUBLE_EQ(only("hop wm -> bg"), 0.2);
  EXPECT_DOUBLE_EQ(only("bg: arrival -> start"), 24.05);
  EXPECT_DOUBLE_EQ(only(kToDrive), 31.0);
}

BudgetRecord record_of(const std::vector<double>& chain_ms) {
  BudgetRecord record;
  record.hops = {{kToNavState, chain_ms}};
  record.scans.sent = record.scans.full = static_cast<std::int64_t>(chain_ms.size());
  record.nodes["sp"] = {100, 3, 0};
  return record;
}

const BudgetVerdict& verdict(const std::vector<BudgetVerdict>& verdicts, const std::string& name) {
  static const BudgetVerdict none;
  for (const BudgetVerdict& v : verdicts) {
    if (v.name == name) return v;
  }
  ADD_FAILURE() << "no verdict on " << name;
  return none;
}

TEST(Budget, LimitsAreComparedWithTheirMetrics) {
  std::vector<double> chain_ms(100);
  std::iota(chain_ms.begin(), chain_ms.end(), 1.0);
  BudgetRecord record = record_of(chain_ms);
  BudgetLimits limits;
  limits.nav_state.p99_ms = 99.0;
  limits.nav_state.max_ms = 99.9;
  limits.drive.p99_ms = 1000.0;
  limits.overrun_share = 0.02;
  std::vector<BudgetVerdict> verdicts = judge(record, limits);
  EXPECT_TRUE(verdict(verdicts, "facet_to_nav_state_p99_ms").kept());
  EXPECT_FALSE(verdict(verdicts, "facet_to_nav_state_max_ms").kept());
  EXPECT_FALSE(verdict(verdicts, "facet_to_drive_p99_ms").kept()) << "nothing was measured";
  EXPECT_FALSE(verdict(verdicts, "overrun_share of sp").kept());
  EXPECT_TRUE(verdict(verdicts, "unaccounted_scans").kept());
  record.scans.unaccounted = 1;
  verdicts = judge(record, {});
  EXPECT_FALSE(verdict(verdicts, "unaccounted_scans").kept()) << "also without a configured limit";
  EXPECT_FALSE(to_json(record, verdicts)["met"].get<bool>());
}

TEST(Budget, TheTableRejectsUnknownKeysAndValues) {
  const auto read = [](const char* text) {
    const Result<ParamFile> file = ParamFile::parse(text, "f");
    EXPECT_TRUE(file.ok());
    return read_budget_limits(*file);
  };
  const Result<BudgetLimits> good =
      read("[sp]\nx = 1\n[budget]\nfacet_to_nav_state_p99_ms = 50\nheld_share = 0.01\n");
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(good->nav_state.p99_ms, 50.0);
  EXPECT_EQ(good->held_share, 0.01);
  EXPECT_FALSE(good->drive.p99_ms.has_value());
  EXPECT_FALSE(read("[budget]\nfacet_to_nav_state_p98_ms = 50\n").ok());
  EXPECT_FALSE(read("[budget]\nheld_share = 1.5\n").ok());
  EXPECT_FALSE(read("[budgets]\nheld_share = 0.5\n").ok());
}

TEST(Budget, RecordsOfLapsArePooled) {
  BudgetRecord sum = record_of({1.0, 2.0});
  sum.add(record_of({3.0}));
  EXPECT_EQ(values_of(sum.hops, kToNavState), (std::vector<double>{1.0, 2.0, 3.0}));
  EXPECT_EQ(sum.scans.sent, 3);
  EXPECT_EQ(sum.nodes["sp"].overruns, 6);
}

TEST(Budget, TheDiagramShowsEveryScan) {
  const report::Plot plot = budget_plot(record_of({1.0, 1.0, 2.0, 200.0}), {}, "title");
  const report::Series& chain = plot.series.front();
  double scans = 0.0;
  for (std::size_t i = 0; i < chain.y.size(); i += 2) scans += chain.y[i] >= 1.0 ? chain.y[i] : 0.0;
  EXPECT_EQ(scans, 4.0);
  EXPECT_NE(report::render(plot, true).find("<svg"), std::string::npos);
}

}  // namespace
}  // namespace rcs::evaluation

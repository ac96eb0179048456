#include "tools/evaluation/uncertainty.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "lcmtypes/channels.h"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/process_t.hpp"
#include "rcs/node/log/log_file.h"
#include "tests/support/fresh_folder.h"
#include "tools/evaluation/run_comparison.h"

namespace rcs::evaluation {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

Stamp at_s(double t_s) { return Stamp(from_seconds(1000.0 + t_s)); }

class Trace : public testing::Test {
 protected:
  template <class M>
  void write(const char* channel, M m, double t_s) {
    m.utime = to_utime(at_s(t_s));
    std::vector<std::uint8_t> data(static_cast<std::size_t>(m.getEncodedSize()));
    m.encode(data.data(), 0, static_cast<int>(data.size()));
    ASSERT_TRUE(writer_.write(at_s(t_s), channel, data.data(), data.size()));
  }
  void process(const char* channel, const char* config, std::int64_t hash) {
    process_t m{};
    m.config = config;
    m.config_hash = hash;
    write(channel, m, 0.0);
  }
  RunTrace trace() {
    EXPECT_TRUE(writer_.close());
    const Result<RunTrace> read = read_trace(path_);
    EXPECT_TRUE(read.ok());
    return read.ok() ? *read : RunTrace{};
  }

  std::string path_ = (test::fresh_folder() / "run.log").string();
  LogWriter writer_ = LogWriter::create(path_).value();
};

TEST_F(Trace, TheConfigurationIsThatOfTheProcessMessages) {
  process(channel::kWmProcess, "config/a.toml", 0x1f);
  process(channel::kSpProcess, "config/a.toml", 0x1f);
  process(channel::kRecordProcess, "", 0);
  process(channel::kWmProcess, "config/a.toml", -1);
  EXPECT_EQ(trace().configuration,
            "config/a.toml (hash 000000000000001f), config/a.toml (hash ffffffffffffffff)");
}

TEST_F(Trace, ALogOfAReplayNamesNoConfiguration) { EXPECT_EQ(trace().configuration, ""); }

TEST_F(Trace, HasSpeedsAtTenHertzAndProtectionLevels) {
  for (int k = 0; k <= 50; ++k) {
    nav_state_t nav{};
    nav.v_world_mps[0] = 3.0;
    nav.v_world_mps[1] = 4.0;
    write(channel::kWmNavState, nav, 0.02 * k);
  }
  integrity_t integrity{};
  integrity.protection_horizontal_m = 2.5;
  integrity.limit_horizontal_m = 20.0;
  write(channel::kWmIntegrity, integrity, 1.0);
  const RunTrace t = trace();
  EXPECT_EQ(t.speed.size(), 11U);
  EXPECT_DOUBLE_EQ(t.speed.back().speed_mps, 5.0);
  ASSERT_EQ(t.protection.size(), 1U);
  EXPECT_EQ(t.protection[0].horizontal_m, 2.5);
}

TEST_F(Trace, StampsOfDamagedMessagesAreIgnored) {
  integrity_t integrity{};
  integrity.utime = std::numeric_limits<std::int64_t>::max();
  std::vector<std::uint8_t> data(static_cast<std::size_t>(integrity.getEncodedSize()));
  integrity.encode(data.data(), 0, static_cast<int>(data.size()));
  ASSERT_TRUE(writer_.write(at_s(0.0), channel::kWmIntegrity, data.data(), data.size()));
  EXPECT_TRUE(trace().protection.empty());
}

/// 10 m/s for 20 s; sigma 0.5 m east and 1 m north.
recording::RunLog drive() {
  recording::RunLog run;
  for (int k = 0; k <= 200; ++k) {
    recording::NavRecord nav;
    nav.stamp = at_s(0.1 * k);
    nav.world_valid = true;
    nav.T_local_vehicle.p.x() = 1.0 * k;
    nav.cov_world_pose = Mat6::Identity();
    nav.cov_world_pose(0, 0) = 0.25;
    run.nav.push_back(nav);
  }
  return run;
}

RunTrace levels(double horizontal_m) {
  RunTrace trace;
  for (int k = 0; k <= 200; ++k) {
    trace.protection.push_back({at_s(0.1 * k), horizontal_m, 5.0, 20.0, kInfinite});
  }
  return trace;
}

std::vector<std::string> labels(const report::Plot& plot) {
  std::vector<std::string> out;
  for (const report::Series& s : plot.series) out.push_back(s.label);
  return out;
}

TEST(Uncertainty, WithoutATruthThereAreBoundsOnly) {
  const std::vector<report::Plot> plots =
      uncertainty_plots(drive(), levels(3.0), nullptr, {}, at_s(0.0));
  ASSERT_EQ(plots.size(), 3U) << "horizontal, vertical, heading";
  EXPECT_THAT(labels(plots[0]),
              testing::ElementsAre("protection level", "alert limit", "3 sigma of WM"));
  EXPECT_THAT(labels(plots[1]), testing::ElementsAre("protection level", "3 sigma of WM"))
      << "an infinite limit is none";
  EXPECT_DOUBLE_EQ(plots[0].series.back().y.front(), 3.0) << "3 sigma in the worst direction";
}

TEST(Uncertainty, AWorldPoseThatNeverWasValidHasNoPlot) {
  recording::RunLog run = drive();
  for (recording::NavRecord& nav : run.nav) nav.world_valid = false;
  RunTrace trace = levels(kInfinite);
  for (ProtectionRecord& r : trace.protection) {
    r.vertical_m = r.limit_horizontal_m = r.limit_vertical_m = kInfinite;
  }
  EXPECT_TRUE(uncertainty_plots(run, trace, nullptr, {}, at_s(0.0)).empty());
}

TEST(Uncertainty, ASilenceInterruptsALine) {
  RunTrace trace;
  trace.speed = {{at_s(0.0), 1.0}, {at_s(0.5), 1.0}, {at_s(3.0), 1.0}};
  const report::Plot plot = speed_plot(trace, {}, at_s(0.0));
  ASSERT_EQ(plot.series[0].y.size(), 4U);
  EXPECT_TRUE(std::isnan(plot.series[0].y[2]));
}

TEST(RunComparison, WithoutATruthShowsTheUncertaintyAtTheEndOfAnOutage) {
  const TimeInterval outage{at_s(5.0), at_s(15.0)};
  const ComparedRun run = compare_run("a", drive(), levels(3.0), nullptr, {outage});
  EXPECT_FALSE(run.with_truth);
  EXPECT_NEAR(run.outages[0].driven_m, 99.0, 1e-9);  // 5.0 s to 14.9 s
  const report::Table table = comparison_table({run});
  EXPECT_THAT(table.rows[0], testing::ElementsAre("a: INS", "99", "1.00", "3.00"));
  const Json json = to_json(run, at_s(0.0));
  EXPECT_TRUE(json["with_gps_horizontal_rms_m"].is_null());
  EXPECT_TRUE(json["outages"][0]["horizontal_m"].is_null());
  EXPECT_EQ(json["outages"][0]["from_s"], 5.0);
  EXPECT_FALSE(ladar_factor({run, run}).has_value());
  EXPECT_EQ(comparison_text({run, run}), "");
}

}  // namespace
}  // namespace rcs::evaluation

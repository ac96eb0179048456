#include "tools/evaluation/evaluation.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/registration_t.hpp"
#include "rcs/node/log/log_file.h"
#include "tools/evaluation/run_comparison.h"
#include "tools/recording/message_fields.h"
#include "tools/report/svg_plot.h"

namespace rcs::evaluation {
namespace {

const Geodetic kDatum = {radians(40.4), radians(-76.6), {150.0}};

Stamp at_s(double t_s) { return Stamp(from_seconds(1000.0 + t_s)); }

/// A straight drive at 10 m/s, 20 s long; fixes end at 5 s and return at 15 s, and meanwhile the
/// world pose drifts to the left by 0.1 m/s.
recording::RunLog drive_with_an_outage() {
  recording::RunLog run;
  run.truth_datum = kDatum;
  run.world_datum = kDatum;
  for (int k = 0; k <= 200; ++k) {
    const double t_s = 0.1 * k;
    const Pose T_true{Quat::Identity(), Vec3(10.0 * t_s, 0.0, 0.0)};
    const bool denied = t_s > 5.0 && t_s < 15.0;
    run.truth.push_back({at_s(t_s), T_true});
    recording::NavRecord nav;
    nav.stamp = at_s(t_s);
    nav.world_valid = true;
    nav.T_world_vehicle = T_true;
    nav.T_local_vehicle = T_true;
    if (denied) nav.T_world_vehicle.p.y() = 0.1 * (t_s - 5.0);
    nav.cov_world_pose = 0.01 * Mat6::Identity();
    nav.age_gps = denied ? from_seconds(t_s - 5.0) : Duration::zero();
    run.nav.push_back(nav);
  }
  return run;
}

TEST(Evaluation, AnOutageIsFoundAndScored) {
  const recording::RunLog run = drive_with_an_outage();
  const std::vector<TimeInterval> outages = gps_outages(run);
  ASSERT_EQ(outages.size(), 1U);
  EXPECT_EQ(outages[0].from, at_s(5.0));
  EXPECT_EQ(outages[0].to, at_s(15.0));

  const std::optional<WorldMetrics> world = world_metrics(run, run.truth, run.truth_datum);
  ASSERT_TRUE(world.has_value());
  const OutageMetrics f = outage_metrics(*world, outages[0]);
  EXPECT_NEAR(f.driven_m, 99.0, 1e-6);  // 5.0 s to 14.9 s
  EXPECT_NEAR(f.end_horizontal_m, 0.99, 1e-6);
  EXPECT_NEAR(f.drift_percent, 1.0, 1e-6);
  EXPECT_NEAR(f.horizontal_m.max, 0.99, 1e-6);
  EXPECT_NEAR(f.horizontal_m.rms, 0.99 / std::sqrt(3.0), 0.01) << "it grows linearly";
}

TEST(Evaluation, AnOutageEndsWithTheFixThatEndsIt) {
  // GIVEN a belief that is published 0.5 s after the fix
  recording::RunLog run = drive_with_an_outage();
  for (recording::NavRecord& nav : run.nav) {
    if (nav.stamp >= at_s(15.0)) nav.age_gps += from_seconds(0.5);
  }
  EXPECT_EQ(gps_outages(run)[0].to, at_s(14.5));
}

TEST(Evaluation, TheIntersectionOfIntervalsIsTheirCommonPart) {
  const std::vector<TimeInterval> a = {{at_s(0), at_s(10)}, {at_s(20), at_s(30)}};
  const std::vector<TimeInterval> b = {{at_s(2), at_s(12)}, {at_s(25), at_s(40)}};
  const std::vector<TimeInterval> both = common_intervals(a, b);
  ASSERT_EQ(both.size(), 2U);
  EXPECT_EQ(both[0].from, at_s(2));
  EXPECT_EQ(both[0].to, at_s(10));
  EXPECT_EQ(both[1].from, at_s(25));
  EXPECT_EQ(both[1].to, at_s(30));
  EXPECT_TRUE(common_intervals(a, {{at_s(10), at_s(20)}}).empty());
  EXPECT_TRUE(common_intervals({}, b).empty());
}

TEST(Evaluation, FusedSourcesAreThoseThatWmAcceptedWithinTheInterval) {
  using I = innovation_t;
  recording::RunLog run = drive_with_an_outage();
  const TimeInterval outage{at_s(5.0), at_s(15.0)};
  for (recording::NavRecord& nav : run.nav) nav.age_ins = Duration(-1);
  EXPECT_TRUE(fused_sources(run, outage).empty());
  run.fused = {{at_s(4.9), I::SOURCE_ROLLING},
               {at_s(5.0), I::SOURCE_GPS_POSITION},
               {at_s(7.0), I::SOURCE_NON_HOLONOMIC},
               {at_s(8.0), I::SOURCE_ODOMETRY},
               {at_s(15.0), I::SOURCE_GPS_POSITION}};
  EXPECT_EQ(fused_sources(run, outage),
            (std::vector<std::string>{"wheel encoders", "motion constraints"}));
  run.fused.push_back({at_s(9.0), I::SOURCE_ROLLING});
  run.fused.push_back({at_s(9.0), I::SOURCE_GPS_VELOCITY});
  for (recording::NavRecord& nav : run.nav) nav.age_ins = from_seconds(0.01);
  EXPECT_EQ(fused_sources(run, outage), (std::vector<std::string>{"GPS", "LADAR", "wheel encoders",
                                                                  "INS", "motion constraints"}));
}

/// A run without GPS for 100 s and 300 m with this error.
ComparedRun run_off_by(const std::string& name, double rms_m, std::vector<std::string> fused) {
  OutageMetrics o;
  o.interval = {at_s(0.0), at_s(100.0)};
  o.driven_m = 300.0;
  o.horizontal_m.rms = rms_m;
  ComparedRun run;
  run.name = name;
  run.outages = {o};
  run.fused = {std::move(fused)};
  return run;
}

TEST(RunComparison, TheSummaryPairsTheRunsThatDifferByTheLadarAlone) {
  std::vector<ComparedRun> runs = {
      run_off_by("all sensors", 0.4, {"LADAR", "a priori map", "wheel encoders", "INS"}),
      run_off_by("wheels", 0.5, {"wheel encoders", "INS"}),
      run_off_by("LADAR", 0.6, {"LADAR", "INS"}), run_off_by("INS alone", 30.0, {"INS"})};
  EXPECT_NEAR(ladar_factor(runs).value_or(0.0), 50.0, 1e-9);
  EXPECT_EQ(comparison_text(runs),
            "Contribution of the LADAR: over 100 s and 300 m without GPS the rms error with and "
            "without the LADAR, other sensors being equal, is 0.40 m and 0.50 m (with wheel "
            "encoders, INS); 0.60 m and 30.00 m (with INS).");
  EXPECT_EQ(comparison_table(runs).rows[3][0], "INS alone: INS");
  EXPECT_EQ(comparison_table(runs).rows[3].back(), "10.00 %");

  EXPECT_EQ(comparison_table(runs).header.front(), "run: sources fused while GPS is denied");
  // A run with GPS shows no effect of the LADAR, independently of its name.
  runs[3].fused = {{"GPS", "INS"}};
  EXPECT_EQ(comparison_table(runs).header.front(), "run: sources fused in the interval");
  EXPECT_NEAR(ladar_factor(runs).value_or(0.0), 1.25, 1e-9);
  runs.erase(runs.begin() + 1);
  EXPECT_FALSE(ladar_factor(runs).has_value());
  EXPECT_EQ(comparison_text(runs), "");
}

TEST(Evaluation, ARunWithoutScansUsesThePosesOfWm) {
  recording::RunLog run = drive_with_an_outage();
  run.nav[3].world_valid = false;
  const Result<recording::ScanPoses> world =
      recording::poses_at_scans(run, recording::Frame::kWorld);
  ASSERT_TRUE(world) << world.error().message;
  EXPECT_EQ(world->poses.size(), 200U);
  EXPECT_EQ(world->scan_ids.back(), 199);
  EXPECT_EQ(recording::poses_at_scans(run, recording::Frame::kLocal)->poses.size(), 201U);
  EXPECT_FALSE(recording::poses_at_scans(run, recording::Frame::kRolling));
  run.nav.clear();
  EXPECT_FALSE(recording::poses_at_scans(run, recording::Frame::kLocal));
}

TEST(Evaluation, APartIsSelectedByTimeSinceTheEarliestMessage) {
  recording::RunLog run = drive_with_an_outage();
  run.nav.erase(run.nav.begin(), run.nav.begin() + 30);  // the truth begins earlier
  cut(from_seconds(5.0), from_seconds(7.0), &run);
  ASSERT_EQ(run.nav.size(), 20U);
  EXPECT_EQ(run.nav.front().stamp, at_s(5.0));
  EXPECT_EQ(run.truth.front().stamp, at_s(5.0));
  EXPECT_EQ(run.truth.back().stamp, at_s(6.9));
  recording::cut(Duration::zero(), from_seconds(1e9), &run);
  EXPECT_EQ(run.nav.size(), 20U);
}

TEST(Evaluation, WorldErrorsAreComputedInTheWorldOfTheGroundTruth) {
  // GIVEN a WM with another datum and the same poses in its own frame
  recording::RunLog run = drive_with_an_outage();
  run.world_datum = Geodetic{kDatum.lat_rad + 1e-4, kDatum.lon_rad - 1e-4, {130.0}};
  const Pose T_world_truthworld = between_worlds(*run.world_datum, kDatum);
  for (recording::NavRecord& nav : run.nav) {
    nav.T_world_vehicle = T_world_truthworld * nav.T_world_vehicle;
  }
  const std::optional<WorldMetrics> world = world_metrics(run, run.truth, run.truth_datum);
  ASSERT_TRUE(world.has_value());
  // THEN the errors are unchanged: the frames are 600 m apart, rounding is below 0.1 mm
  EXPECT_NEAR(world->horizontal_m.max, 0.99, 1e-4);
  EXPECT_LT(world->vertical_m.max, 1e-4);
  const Pose back = between_worlds(kDatum, *run.world_datum) * T_world_truthworld;
  EXPECT_LT(log_se3(back).norm(), 1e-6);
}

TEST(Evaluation, WithoutTruthOrDatumThereIsNoWorldError) {
  recording::RunLog run = drive_with_an_outage();
  EXPECT_FALSE(world_metrics(run, {}, kDatum).has_value());
  run.world_datum.reset();
  EXPECT_FALSE(world_metrics(run, run.truth, kDatum).has_value());
}

recording::ScanRecord scan_at(double t_s, std::int64_t id, std::int32_t epoch, double x_m) {
  recording::ScanRecord scan;
  scan.reference = at_s(t_s);
  scan.scan_id = id;
  scan.map_epoch = epoch;
  scan.T_rolling_vehicle = Pose{Quat::Identity(), Vec3(x_m, 0.0, 0.0)};
  return scan;
}

TEST(RunLog, ScansBeforeTheFirstBeliefArePropagatedByTheRollingMap) {
  recording::RunLog run = drive_with_an_outage();
  run.nav.erase(run.nav.begin(), run.nav.begin() + 10);  // nothing before 1 s
  run.scans = {scan_at(0.5, 1, 1, 0.0), scan_at(1.0, 2, 1, 5.0), scan_at(1.55, 3, 1, 10.5)};
  const Result<recording::ScanPoses> poses =
      recording::poses_at_scans(run, recording::Frame::kLocal);
  ASSERT_TRUE(poses.ok()) << poses.error().message;
  ASSERT_EQ(poses->poses.size(), 3U);
  EXPECT_EQ(poses->carried, 1U);
  EXPECT_NEAR(poses->poses[0].T.p.x(), 5.0, 1e-9);
  EXPECT_NEAR(poses->poses[1].T.p.x(), 10.0, 1e-9);
  EXPECT_NEAR(poses->poses[2].T.p.x(), 15.5, 1e-9);  // between two nav states
}

TEST(RunLog, RollingPosesOfTwoMapsShareNoFrame) {
  recording::RunLog run;
  run.scans = {scan_at(0.0, 1, 1, 0.0), scan_at(0.1, 2, 2, 0.0)};
  EXPECT_FALSE(recording::poses_at_scans(run, recording::Frame::kRolling).ok());
  run.scans[1].map_epoch = 1;
  EXPECT_TRUE(recording::poses_at_scans(run, recording::Frame::kRolling).ok());
}

TEST(RunLog, ReadsWrittenMessagesAndCountsUnreadableOnes) {
  const std::string path = ::testing::TempDir() + "run_log_test.log";
  Result<LogWriter> writer = LogWriter::create(path);
  ASSERT_TRUE(writer.ok());
  registration_t m{};
  m.utime = 5;
  m.seq = 1;
  m.scan_id = 9;
  to_message(Pose{Quat::Identity(), Vec3(1, 2, 3)}, m.q_target_vehicle, m.p_target_vehicle_m);
  std::vector<std::uint8_t> data(static_cast<std::size_t>(m.getEncodedSize()));
  ASSERT_EQ(m.encode(data.data(), 0, m.getEncodedSize()), m.getEncodedSize());
  ASSERT_TRUE(writer->write(at_s(0), channel::kSpRegistration, data.data(), data.size()).ok());
  ASSERT_TRUE(writer->write(at_s(0), channel::kSpRegistration, data.data(), 20).ok());
  ASSERT_TRUE(writer->close().ok());

  const Result<recording::RunLog> run = recording::read_run(path);
  ASSERT_TRUE(run.ok());
  ASSERT_EQ(run->scans.size(), 1U);
  EXPECT_EQ(run->scans[0].scan_id, 9);
  EXPECT_EQ(run->undecodable, 1);

  const std::optional<recording::MessageHead> head =
      recording::read_head(channel::kSpRegistration, data);
  ASSERT_TRUE(head.has_value());
  EXPECT_EQ(head->seq, 1);
  EXPECT_FALSE(recording::read_head(channel::kIns, data).has_value());  // of a different type
  const std::optional<recording::Fields> fields =
      recording::read_fields(channel::kSpRegistration, data);
  ASSERT_TRUE(fields.has_value());
  EXPECT_EQ((*fields)[4], (std::pair<std::string, std::string>("scan_id", "9")));
  std::remove(path.c_str());
}

TEST(SvgPlot, TicksAreRoundAndInside) {
  EXPECT_EQ(report::round_ticks(0.0, 10.0, 5), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  for (const double tick : report::round_ticks(-0.013, 0.047, 6)) {
    EXPECT_GE(tick, -0.013 - 1e-9);
    EXPECT_LE(tick, 0.047 + 1e-9);
  }
}

TEST(SvgPlot, TextIsEscapedAndEmptyPlotsAreDrawn) {
  report::Plot plot;
  plot.title = "<script>\"&";
  plot.series.push_back({"", report::Colour::kBlue, report::SeriesStyle::kBand, {}, {}, {}});
  const std::string svg = report::render(plot, true);
  EXPECT_EQ(svg.find("<script>"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_NE(svg.find("</svg>"), std::string::npos);
}

}  // namespace
}  // namespace rcs::evaluation

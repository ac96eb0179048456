// Metrics of a drill on synthetic runs with known results.

#include <gmock/gmock.h>

#include <cmath>

#include "lcmtypes/rcs/innovation_t.hpp"
#include "lcmtypes/rcs/integrity_t.hpp"
#include "lcmtypes/rcs/subfilter_t.hpp"
#include "tests/tools/drills/drill_fixture.h"
#include "tools/drills/drill_output.h"
#include "tools/drills/drill_result.h"

namespace rcs::test {
namespace {

drills::Drill gps_lost(double begin_s, double length_s) {
  drills::Drill drill;
  drill.id = "made_up";
  drills::Stimulus s;
  s.begin_s = begin_s;
  s.length_s = length_s;
  drill.stimuli = {s};
  return drill;
}

drills::Drill ramp(double begin_s, double length_s) {
  drills::Drill drill = gps_lost(begin_s, length_s);
  drill.stimuli.front().kind = drills::StimulusKind::kRamp;
  return drill;
}

/// Ten a second: protection levels of 2 m, limits 5 and 3 m, all sources accepted.
void protect(drills::DrillRecord* r) {
  for (int k = 0; k < 600; ++k) {
    drills::DrillIntegrity i;
    i.stamp = kBegin + from_seconds(0.1 * k);
    i.horizontal_m = i.vertical_m = 2.0;
    i.limit_horizontal_m = 5.0;
    i.limit_vertical_m = 3.0;
    i.gps = i.ladar = integrity_t::STATUS_ACCEPTED;
    r->integrity.push_back(i);
  }
}

template <class Change>
void integrity_within(double from_s, double to_s, drills::DrillRecord* r, Change change) {
  for (drills::DrillIntegrity& i : r->integrity) {
    if (time_s(i.stamp) >= from_s - 0.01 && time_s(i.stamp) < to_s - 0.01) change(&i);
  }
}

/// A fix every 0.2 s with the error `error` within the window, all of them accepted where `taken`
/// is set.
template <class Taken>
void add_fixes(double from_s, double to_s, const Vec3& error, drills::DrillRecord* r, Taken taken) {
  for (int k = 0; k < 300; ++k) {
    const double t_s = 0.2 * k;
    drills::DrillFix f;
    f.stamp = f.arrival = kBegin + from_seconds(t_s);
    f.utime = to_utime(f.stamp);
    f.p_world = Vec3(10.0 * t_s, 0.0, 0.0);
    if (t_s >= from_s - 0.01 && t_s < to_s - 0.01) f.p_world += error;
    f.sigma_m = Vec3::Constant(0.3);
    r->fixes.push_back(f);
    drills::DrillInnovation i;
    i.stamp = f.stamp;
    i.arrival = f.arrival + std::chrono::milliseconds(20);
    i.utime = f.utime;
    i.source = innovation_t::SOURCE_GPS_POSITION;
    i.accepted = taken(t_s);
    i.dof = 3;
    i.nis = 6.0;
    r->innovations.push_back(i);
  }
}

TEST(DrillMetrics, AnErrorFreeRunHasNoErrors) {
  const drills::DrillRecord r = right_record();
  const drills::DrillRunMetrics f = drills::drill_metrics(gps_lost(20, 20), 1, r);
  EXPECT_LT(f.accuracy.horizontal_max_m, 1e-9);
  EXPECT_LT(f.accuracy.nees_per_dof, 1e-9);
  EXPECT_LT(f.smooth.m, 1e-9);
  ASSERT_EQ(f.outages.size(), 1U);
  EXPECT_NEAR(f.outages[0].driven_m, 200.0, 0.5);
  EXPECT_FALSE(f.integrity.has_value());
}

TEST(DrillMetrics, DriftIsTheFinalErrorPerDistanceDriven) {
  drills::DrillRecord r = right_record();
  // 1.2 m at the end of 20 s at 10 m/s.
  for (drills::DrillBelief& b : r.beliefs) {
    const double since_s = std::clamp(time_s(b.stamp) - 20.0, 0.0, 20.0);
    b.T_world_vehicle.p.y() += 0.06 * since_s;
    b.T_world_vehicle.q = exp_so3(Vec3(0.0, 0.0, radians(0.5)));
  }
  const drills::DrillRunMetrics f = drills::drill_metrics(gps_lost(20, 20), 1, r);
  ASSERT_EQ(f.outages.size(), 1U);
  EXPECT_NEAR(f.outages[0].end_m, 1.2, 0.01);
  EXPECT_NEAR(f.outages[0].drift_pct, 0.6, 0.01);
  EXPECT_NEAR(f.outages[0].m_per_min, 3.6, 0.03);
  EXPECT_NEAR(degrees(f.outages[0].heading_start_rad), 0.5, 1e-6);
  EXPECT_NEAR(f.accuracy.along_rms_m, 0.0, 1e-9);
  EXPECT_GT(f.accuracy.across_rms_m, 0.5);
}

TEST(DrillMetrics, FlappingCountsAsSeveralOutages) {
  drills::Drill drill = gps_lost(10, 15);
  drill.stimuli.front().kind = drills::StimulusKind::kFlapping;
  drill.stimuli.front().count = 3;
  const std::vector<drills::DrillWindow> outages = drills::gps_outages_of(drill);
  ASSERT_EQ(outages.size(), 3U);
  EXPECT_EQ(outages[1].begin_s, 16.0);
  EXPECT_EQ(outages[1].end_s, 20.0);
}

TEST(DrillMetrics, PercentilesAndConsistency) {
  drills::DrillRecord r = right_record();
  mislead(20, 60.1, Vec3(0.0, 0.1, 0.2), &r);  // errors of one sigma and two
  const drills::AccuracyMetrics f = drills::accuracy(gps_lost(20, 20), drills::DrillErrors(r));
  EXPECT_NEAR(f.cep50_m, 0.1, 1e-9);
  EXPECT_NEAR(f.cep95_m, 0.1, 1e-9);
  EXPECT_NEAR(f.vertical95_m, 0.2, 1e-9);
  EXPECT_NEAR(f.nees_per_dof, (1.0 + 4.0) / 6.0, 0.01);
}

TEST(DrillMetrics, ALocalStepIsTheMotionThatTheLastCycleDidNotPredict) {
  drills::DrillRecord r = right_record();
  for (drills::DrillBelief& b : r.beliefs) {
    if (time_s(b.stamp) >= 30.0) b.T_local_vehicle.p.y() += 0.07;
  }
  const drills::SmoothStep step = drills::largest_smooth_step(gps_lost(20, 20), r);
  EXPECT_NEAR(step.m, 0.07, 1e-6);
  EXPECT_NEAR(step.t_s, 30.0, 0.021);
  // Steps of the world pose are allowed.
  drills::DrillRecord reset = right_record();
  mislead(30, 60, Vec3(3.0, 0.0, 0.0), &reset);
  EXPECT_LT(drills::largest_smooth_step(gps_lost(20, 20), reset).m, 1e-9);
}

TEST(DrillMetrics, ThreeSecondsOutsideWithoutAnAlertAreOneMissedAlert) {
  drills::DrillRecord r = right_record();
  protect(&r);
  mislead(30, 33, Vec3(2.5, 0.0, 0.0), &r);
  const auto f = drills::integrity_metrics(gps_lost(20, 20), r, drills::DrillErrors(r));
  ASSERT_TRUE(f.has_value());
  EXPECT_EQ(f->missed_alerts, 1);
  EXPECT_NEAR(f->within_horizontal, 1.0 - 30.0 / 400.0, 0.004);
  EXPECT_EQ(f->within_vertical, 1.0);
}

TEST(DrillMetrics, AShortExcursionOrAnAlarmedOneIsNoMissedAlert) {
  drills::DrillRecord brief = right_record();
  protect(&brief);
  mislead(30, 31.5, Vec3(0.0, 0.0, 2.5), &brief);
  const auto f = drills::integrity_metrics(gps_lost(20, 20), brief, drills::DrillErrors(brief));
  EXPECT_EQ(f->missed_alerts, 0);
  EXPECT_LT(f->within_vertical, 1.0);

  drills::DrillRecord alarmed = right_record();
  protect(&alarmed);
  mislead(30, 40, Vec3(2.5, 0.0, 0.0), &alarmed);
  integrity_within(31, 40, &alarmed,
                   [](drills::DrillIntegrity* i) { i->alerts = integrity_t::ALERT_HORIZONTAL; });
  EXPECT_EQ(drills::integrity_metrics(gps_lost(20, 20), alarmed, drills::DrillErrors(alarmed))
                ->missed_alerts,
            0);
}

TEST(DrillMetrics, TimeToAlertRunsFromTheBeginOfTheFalseSource) {
  drills::DrillRecord r = right_record();
  protect(&r);
  EXPECT_FALSE(drills::integrity_metrics(ramp(20, 20), r, drills::DrillErrors(r))
                   ->time_to_alert_s.has_value());
  integrity_within(27.5, 50, &r,
                   [](drills::DrillIntegrity* i) { i->gps = integrity_t::STATUS_QUARANTINE; });
  const auto f = drills::integrity_metrics(ramp(20, 20), r, drills::DrillErrors(r));
  ASSERT_TRUE(f->time_to_alert_s.has_value());
  EXPECT_NEAR(*f->time_to_alert_s, 7.5, 0.11);
  // An outage is not a false source.
  EXPECT_FALSE(
      drills::integrity_metrics(gps_lost(20, 20), r, drills::DrillErrors(r))->alert_expected);
}

TEST(DrillMetrics, AnAlertWithoutAFaultIsFalse) {
  drills::Drill drill = gps_lost(50, 2);
  drills::DrillRecord r = right_record();
  protect(&r);
  const auto alert = [](drills::DrillIntegrity* i) { i->alerts = integrity_t::ALERT_GPS; };
  integrity_within(51, 55, &r, alert);
  EXPECT_EQ(drills::integrity_metrics(drill, r, drills::DrillErrors(r))->false_alerts_per_h, 0.0);
  integrity_within(30, 31, &r, alert);
  // One in the half minute between the first 20 s and the stimulus.
  EXPECT_NEAR(drills::integrity_metrics(drill, r, drills::DrillErrors(r))->false_alerts_per_h,
              120.0, 2.0);
}

TEST(DrillMetrics, AnAcceptedFixWithALargeErrorIsAFalseAcceptance) {
  const auto all = [](double) { return true; };
  drills::DrillRecord r = right_record();
  // Total sigma: 0.316 m.
  add_fixes(30, 31, Vec3(0.0, 2.2, 0.0), &r, all);
  EXPECT_EQ(drills::false_acceptances(r, drills::DrillErrors(r)).size(), 5U);
  drills::DrillRecord within = right_record();
  add_fixes(30, 31, Vec3(0.0, 1.6, 0.0), &within, all);
  EXPECT_TRUE(drills::false_acceptances(within, drills::DrillErrors(within)).empty());
  drills::DrillRecord refused = right_record();
  add_fixes(30, 31, Vec3(0.0, 50.0, 0.0), &refused,
            [](double t_s) { return t_s < 29.9 || t_s > 31.1; });
  EXPECT_TRUE(drills::false_acceptances(refused, drills::DrillErrors(refused)).empty());
}

TEST(DrillMetrics, AFixWithExcludedHeightIsJudgedWithoutIt) {
  drills::DrillRecord r = right_record();
  add_fixes(30, 31, Vec3(0.0, 0.0, 33.0), &r, [](double) { return true; });
  EXPECT_EQ(drills::false_acceptances(r, drills::DrillErrors(r)).size(), 5U);
  for (drills::DrillInnovation& i : r.innovations) i.dof = 2;
  EXPECT_TRUE(drills::false_acceptances(r, drills::DrillErrors(r)).empty());
}

TEST(DrillMetrics, AnAcceptedNonFiniteFixIsAFalseAcceptance) {
  drills::DrillRecord r = right_record();
  add_fixes(30, 30.1, Vec3::Constant(std::nan("")), &r, [](double) { return true; });
  EXPECT_EQ(drills::false_acceptances(r, drills::DrillErrors(r)).size(), 1U);
}

TEST(DrillMetrics, RecoveryIsCountedFromTheFirstCleanFix) {
  drills::DrillRecord r = right_record();
  // Fixes with an error of 50 m continue for 3 s after the outage; clean ones are accepted from 44
  // s on.
  add_fixes(40, 43, Vec3(50.0, 0.0, 0.0), &r, [](double t_s) { return t_s >= 43.99; });
  const std::vector<drills::GpsReturn> returns =
      drills::gps_returns(gps_lost(20, 20), r, drills::DrillErrors(r));
  ASSERT_EQ(returns.size(), 1U);
  EXPECT_NEAR(returns[0].clean_s, 43.0, 0.01);
  ASSERT_TRUE(returns[0].accepted_after_s.has_value());
  EXPECT_NEAR(*returns[0].accepted_after_s, 1.0, 0.01);

  drills::DrillRecord never = right_record();
  add_fixes(0, 0, Vec3::Zero(), &never, [](double t_s) { return t_s < 20.0; });
  const std::vector<drills::GpsReturn> none =
      drills::gps_returns(gps_lost(20, 20), never, drills::DrillErrors(never));
  ASSERT_EQ(none.size(), 1U);
  EXPECT_FALSE(none[0].accepted_after_s.has_value());
}

TEST(DrillMetrics, BaselinesAreComparedAtTheSameInstantsWithAFloor) {
  drills::DrillRecord r = right_record();
  mislead(20, 40, Vec3(0.6, 0.0, 0.0), &r);
  for (int k = 0; k < 120; ++k) {
    drills::DrillSubfilter s;
    s.stamp = kBegin + from_seconds(0.5 * k);
    s.kind = k % 2 == 0 ? int{subfilter_t::KIND_WITHOUT_GPS} : int{subfilter_t::KIND_INERTIAL};
    s.T_world_vehicle.p = Vec3(5.0 * k, k % 2 == 0 ? 0.3 : 0.01, 0.0);
    r.subfilters.push_back(s);
  }
  const drills::Baselines b =
      drills::subfilter_baselines(gps_lost(20, 20), r, drills::DrillErrors(r));
  EXPECT_EQ(b[subfilter_t::KIND_WITHOUT_LADAR].samples, 0U);
  EXPECT_EQ(b[subfilter_t::KIND_WITHOUT_GPS].samples, 20U);
  EXPECT_NEAR(b[subfilter_t::KIND_WITHOUT_GPS].ratio(), 2.0, 0.01);
  EXPECT_NEAR(b[subfilter_t::KIND_INERTIAL].ratio(), 3.0, 0.01)
      << "errors below 0.2 m count as 0.2 m";

  drills::DrillRecord other = right_record();
  mislead(0, 60, Vec3(0.0, 1.2, 0.0), &other);
  EXPECT_NEAR(drills::run_baseline(gps_lost(20, 20), drills::DrillErrors(r), other).ratio(), 0.5,
              0.01);
}

TEST(DrillMetrics, InnovationsBySource) {
  drills::DrillRecord r = right_record();
  add_fixes(0, 0, Vec3::Zero(), &r, [](double t_s) { return t_s < 29.99; });
  // Gated innovations count, otherwise the gate would make any filter look consistent; innovations
  // of excluded sources do not.
  for (std::size_t k = 150; k < 300; ++k) {
    const bool by_gate = k < 200;
    r.innovations[k].nis = by_gate ? 18.0 : 1e6;
    r.innovations[k].reason = by_gate ? innovation_t::REASON_GATE : innovation_t::REASON_QUARANTINE;
  }
  const std::map<std::string, drills::NisMetric> nis = drills::nis_metrics(r);
  EXPECT_EQ(nis.at("gps position").considered, 300U);
  EXPECT_EQ(nis.at("gps position").accepted, 150U);
  EXPECT_EQ(nis.at("gps position").gated, 200U);
  EXPECT_NEAR(nis.at("gps position").per_dof, (150 * 2.0 + 50 * 6.0) / 200, 1e-9);
}

// ---- limits ---------------------------------------------------------------------------------

const drills::LimitResult& mark(const std::vector<drills::LimitResult>& limits,
                                std::string_view key) {
  return *std::find_if(limits.begin(), limits.end(),
                       [key](const drills::LimitResult& m) { return m.kind->key == key; });
}

TEST(DrillLimits, AnUnpublishedMetricFails) {
  drills::Drill drill = gps_lost(20, 20);
  drill.limits = {{"within_protection", 0.999}, {"missed_alerts", 0.0}, {"smooth_step_m", 0.05}};
  drills::DrillRecord r = right_record();
  std::vector<drills::LimitResult> limits = judge(drill, {drills::drill_metrics(drill, 1, r)});
  EXPECT_EQ(mark(limits, "within_protection").verdict, drills::Verdict::kFail);
  EXPECT_EQ(mark(limits, "within_protection").note, "not published");
  EXPECT_EQ(mark(limits, "missed_alerts").verdict, drills::Verdict::kFail);
  EXPECT_EQ(mark(limits, "smooth_step_m").verdict, drills::Verdict::kPass);
  protect(&r);
  limits = judge(drill, {drills::drill_metrics(drill, 1, r)});
  EXPECT_EQ(mark(limits, "within_protection").verdict, drills::Verdict::kPass);
}

TEST(DrillLimits, MedianAndRatioNeedTheirSeeds) {
  drills::Drill drill = gps_lost(20, 20);
  drill.limits = {{"drift_pct_median", 0.5}, {"drift_pct_p95", 1.0}, {"ratio", 1.05}};
  drills::DrillRecord r = right_record();
  mislead(20, 60, Vec3(0.0, 1.2, 0.0), &r);  // 0.6 %
  drills::DrillRunMetrics f = drills::drill_metrics(drill, 1, r);
  f.baselines[0] = {10, 40.0, 10.0};
  for (const auto& [seeds, drift, ratio] :
       {std::tuple(1, drills::Verdict::kInconclusive, drills::Verdict::kInconclusive),
        std::tuple(5, drills::Verdict::kFail, drills::Verdict::kInconclusive),
        std::tuple(20, drills::Verdict::kFail, drills::Verdict::kFail)}) {
    const std::vector<drills::DrillRunMetrics> runs(static_cast<std::size_t>(seeds), f);
    const std::vector<drills::LimitResult> limits = judge(drill, runs);
    EXPECT_EQ(mark(limits, "drift_pct_median").verdict, drift) << seeds;
    EXPECT_EQ(mark(limits, "drift_pct_p95").verdict, drills::Verdict::kPass) << seeds;
    EXPECT_EQ(mark(limits, "ratio").verdict, ratio) << seeds;
    EXPECT_NEAR(*mark(limits, "ratio").value, 2.0, 1e-9);
  }
}

TEST(DrillLimits, GpsThatIsNeverReadmittedFails) {
  drills::Drill drill = gps_lost(20, 20);
  drill.limits = {{"accept_within_s", 5.0}};
  drills::DrillRecord r = right_record();
  add_fixes(0, 0, Vec3::Zero(), &r, [](double t_s) { return t_s < 20.0; });
  const std::vector<drills::LimitResult> limits =
      judge(drill, {drills::drill_metrics(drill, 1, r)});
  EXPECT_EQ(limits[0].verdict, drills::Verdict::kFail);
  EXPECT_EQ(limits[0].note, "never");
}

TEST(DrillLimits, ARunWithoutTruthPassesNothing) {
  drills::Drill drill = gps_lost(20, 20);
  drill.limits = {{"false_acceptances", 0.0}, {"smooth_step_m", 0.05}};
  drills::DrillRecord r = right_record();
  r.truth.clear();
  for (const drills::LimitResult& m : judge(drill, {drills::drill_metrics(drill, 1, r)})) {
    EXPECT_EQ(m.verdict, drills::Verdict::kFail) << m.kind->key;
  }
}

TEST(DrillOutput, JsonAndJUnitAgree) {
  drills::DrillResult r;
  r.drill = gps_lost(20, 20);
  r.drill.name = "A & B <made up>";
  r.drill.limits = {{"smooth_step_m", 0.05}, {"missed_alerts", 0.0}, {"ratio", 1.05}};
  r.runs = {drills::drill_metrics(r.drill, 7, right_record())};
  r.runs[0].baselines[0] = {10, 40.0, 10.0};
  r.limits = judge(r.drill, r.runs);
  const nlohmann::ordered_json j = drills::to_json({r});
  EXPECT_EQ(j["drills"][0]["verdict"], "FAIL");
  EXPECT_EQ(j["drills"][0]["runs"][0]["seed"], 7);
  EXPECT_EQ(j["drills"][0]["runs"][0]["integrity"], "not published");
  const std::string xml = drills::to_junit({r});
  EXPECT_THAT(xml, testing::HasSubstr("tests=\"3\" failures=\"1\" skipped=\"1\""));
  EXPECT_THAT(xml, testing::HasSubstr("not published"));
  EXPECT_THAT(to_text(drills::drill_table({r})), testing::HasSubstr("FAIL"));
}

}  // namespace
}  // namespace rcs::test

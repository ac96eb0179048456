// Dead reckoning on synthetic samples; the runs for a study of outages, and the evaluation of their
// records.

#include "tools/studies/outages.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/tools/drills/drill_fixture.h"
#include "tools/studies/dead_reckoning.h"
#include "tools/studies/outages_output.h"

namespace rcs::test {
namespace {

using testing::HasSubstr;

constexpr double kSpeed_mps = 10.0;
constexpr double kTurn_radps = 0.1;

studies::ReckoningStart start_east() {
  studies::ReckoningStart s;
  s.stamp = kBegin;
  s.v_world = Vec3(kSpeed_mps, 0.0, 0.0);
  return s;
}

/// A minute on a circle to the left on level ground, at 100 and 10 Hz, without errors, on a
/// rotating earth.
studies::RecordedMotion circle() {
  studies::RecordedMotion m;
  m.begin = kBegin;
  m.place = datum();
  const Vec3 earth = earth_rate_world(datum().lat_rad);
  const double gravity = normal_gravity(datum().lat_rad, datum().height);
  for (int k = 1; k <= 6000; ++k) {
    wm::ImuSample s;
    s.stamp = kBegin + from_seconds(0.01 * k);
    s.interval = from_seconds(0.01);
    const double yaw = kTurn_radps * 0.01 * (k - 0.5);
    const Quat q_vehicle_world = exp_so3(Vec3(0.0, 0.0, -yaw));
    const Vec3 v_world = kSpeed_mps * Vec3(std::cos(yaw), std::sin(yaw), 0.0);
    const Vec3 coriolis = 2.0 * (q_vehicle_world * earth.cross(v_world));
    s.delta_angle = 0.01 * (Vec3(0.0, 0.0, kTurn_radps) + q_vehicle_world * earth);
    s.delta_v = 0.01 * (Vec3(0.0, kTurn_radps * kSpeed_mps, gravity) + coriolis);
    m.inertial.push_back(s);
  }
  for (int k = 1; k <= 600; ++k) {
    m.wheels.push_back(
        {kBegin + from_seconds(0.1 * k), from_seconds(0.1), kSpeed_mps, kTurn_radps});
  }
  m.end = m.inertial.back().stamp;
  return m;
}

Vec3 on_circle(double t_s) {
  const double radius_m = kSpeed_mps / kTurn_radps;
  const double yaw = kTurn_radps * t_s;
  return radius_m * Vec3(std::sin(yaw), 1.0 - std::cos(yaw), 0.0);
}

constexpr studies::ReckonedBy kAll[] = {
    studies::ReckonedBy::kGyroAndWheels, studies::ReckonedBy::kGyroAndLastSpeed,
    studies::ReckonedBy::kWheels, studies::ReckonedBy::kInertial};

TEST(DeadReckoning, PerfectSensorsEndAtTheTruePosition) {
  const studies::RecordedMotion motion = circle();
  for (const studies::ReckonedBy by : kAll) {
    // Also between samples: the last one counts in part.
    for (const double t_s : {30.0, 17.123}) {
      const auto T = studies::reckon(by, start_east(), motion, kBegin + from_seconds(t_s));
      ASSERT_TRUE(T);
      // Without the earth rate the gyro has an error of 2 mrad after 30 s.
      EXPECT_LT((T->p - on_circle(t_s)).norm(), 0.4) << static_cast<int>(by);
      EXPECT_NEAR(yaw_of(T->q), kTurn_radps * t_s - (kTurn_radps * t_s > M_PI ? 2 * M_PI : 0),
                  3e-3);
    }
  }
  const auto T = studies::reckon(studies::ReckonedBy::kInertial, start_east(), motion,
                                 kBegin + from_seconds(30.0));
  EXPECT_LT((T->p - on_circle(30.0)).norm(), 0.02);
}

TEST(DeadReckoning, EstimatedSensorErrorsAreRemoved) {
  studies::RecordedMotion motion = circle();
  studies::ReckoningStart start = start_east();
  start.gyro_bias_radps = Vec3(0.01, -0.02, 0.03);
  start.accel_bias_mps2 = Vec3(0.1, 0.2, -0.3);
  start.wheel_scale = 1.1;
  for (wm::ImuSample& s : motion.inertial) {
    s.delta_angle += 0.01 * start.gyro_bias_radps;
    s.delta_v += 0.01 * start.accel_bias_mps2;
  }
  for (studies::WheelSample& s : motion.wheels) s.speed_mps *= start.wheel_scale;
  for (const studies::ReckonedBy by : kAll) {
    const auto T = studies::reckon(by, start, motion, kBegin + from_seconds(30.0));
    ASSERT_TRUE(T);
    EXPECT_LT((T->p - on_circle(30.0)).norm(), 0.4) << static_cast<int>(by);
  }
}

TEST(DeadReckoning, AGapOrAnUnknownErrorGivesNoResult) {
  studies::RecordedMotion motion = circle();
  const Stamp to = kBegin + std::chrono::seconds(30);
  for (studies::WheelSample& s : motion.wheels) s.yaw_rate_radps = std::nan("");
  EXPECT_FALSE(studies::reckon(studies::ReckonedBy::kWheels, start_east(), motion, to));
  EXPECT_TRUE(studies::reckon(studies::ReckonedBy::kGyroAndWheels, start_east(), motion, to));
  motion.wheels.erase(motion.wheels.begin() + 100, motion.wheels.begin() + 130);
  EXPECT_FALSE(studies::reckon(studies::ReckonedBy::kGyroAndWheels, start_east(), motion, to));
  motion.inertial.erase(motion.inertial.begin() + 1000, motion.inertial.begin() + 1060);
  EXPECT_FALSE(studies::reckon(studies::ReckonedBy::kInertial, start_east(), motion, to));
  motion = circle();
  motion.place.reset();
  EXPECT_FALSE(studies::reckon(studies::ReckonedBy::kInertial, start_east(), motion, to));
  EXPECT_FALSE(studies::reckon(studies::ReckonedBy::kGyroAndWheels, start_east(), motion,
                               motion.end + std::chrono::seconds(1)));
}

TEST(Outages, OutagesAreSpreadOverTheDrive) {
  studies::OutageQuestion q;
  q.lengths_s = {10.0, 20.0};
  q.places = 3;
  q.without = {{drills::DrillSource::kOdometry}};
  const auto plans = studies::plan_outages(q, 60.5, true);
  ASSERT_TRUE(plans);
  ASSERT_EQ(plans->size(), 2U * (1 + 6) + 1);
  EXPECT_EQ((*plans)[0].kind, studies::OutagePlan::Kind::kWmWithGps);
  EXPECT_TRUE((*plans)[0].drill.stimuli.empty());
  std::vector<double> begins_s;
  for (std::size_t k = 1; k <= 6; ++k) begins_s.push_back((*plans)[k].window.begin_s);
  EXPECT_EQ(begins_s, (std::vector<double>{20, 35, 50, 20, 30, 40}));
  const studies::OutagePlan& last = (*plans)[13];
  EXPECT_EQ(last.variant, 1U);
  ASSERT_EQ(last.drill.stimuli.size(), 2U);
  EXPECT_EQ(last.drill.stimuli[0].source, drills::DrillSource::kGps);
  EXPECT_EQ(last.drill.stimuli[0].begin_s, 40.0);
  EXPECT_EQ(last.drill.stimuli[0].end_s(), 60.0);
  EXPECT_EQ(last.drill.stimuli[1].source, drills::DrillSource::kOdometry);
  EXPECT_EQ(last.drill.stimuli[1].begin_s, 0.0);
  EXPECT_EQ(plans->back().kind, studies::OutagePlan::Kind::kNoGps);

  q.lengths_s = {60.0};
  const auto too_long = studies::plan_outages(q, 60.5, false);
  ASSERT_FALSE(too_long);
  EXPECT_THAT(too_long.error().message, HasSubstr("an outage of 60 s"));
  q.cut = drills::DrillWindow{30.0, 70.0};
  EXPECT_FALSE(studies::plan_outages(q, 60.5, false));
  q.cut->end_s = 50.0;
  ASSERT_TRUE(studies::plan_outages(q, 60.5, false));
  EXPECT_EQ(studies::plan_outages(q, 60.5, false)->size(), 4U);
}

TEST(Outages, OmittedSourcesAreNamed) {
  EXPECT_EQ(*studies::parse_without("odometry"), std::vector{drills::DrillSource::kOdometry});
  EXPECT_EQ(*studies::parse_without("ladar+ins+ladar"),
            (std::vector{drills::DrillSource::kLadar, drills::DrillSource::kIns}));
  for (const char* wrong : {"", "gps", "odometry+", "wheels"}) {
    EXPECT_FALSE(studies::parse_without(wrong));
  }
}

/// Of right_record(), 60 s east at 10 m/s: WM has an error of 3 m to the north in the outage from
/// 30 to 40 s, and the first fix after it lies 1 m south.
class OneOutage : public testing::Test {
 protected:
  OneOutage() {
    question_.lengths_s = {10.0};
    question_.cut = drills::DrillWindow{30.0, 40.0};
    plans_ = studies::plan_outages(question_, 60.0, true).value();
    for (const studies::OutagePlan& plan : plans_) {
      results_.push_back({plan.drill, {drills::DrillRunMetrics{}}, {}, right_record(), {}, {}});
    }
    mislead(35.0, 40.1, Vec3(0.0, 3.0, 4.0), &*results_[1].shown);
    for (const double t_s : {20.0, 40.05}) {
      drills::DrillFix fix;
      fix.stamp = fix.arrival = kBegin + from_seconds(t_s);
      fix.p_world = Vec3(10.0 * t_s, -1.0, 0.0);
      fix.sigma_m = Vec3(0.5, 0.7, 1.0);
      results_[1].shown->fixes.push_back(fix);
    }
    for (int k = 0; k <= 600; ++k) {  // the map drifts by 1 cm a metre
      results_.back().shown->matches.push_back(
          {kBegin + from_seconds(0.1 * k), 1, {Quat::Identity(), {1.01 * k, 0.0, 0.0}}});
    }
    motion_.begin = kBegin;
    motion_.end = kBegin + std::chrono::seconds(60);
    motion_.place = datum();
    motion_.has_truth = true;
    motion_.has_ladar = true;
    for (int k = 1; k <= 600; ++k) {
      motion_.wheels.push_back(
          {kBegin + from_seconds(0.1 * k), from_seconds(0.1), 1.02 * kSpeed_mps, 0.0});
    }
  }
  [[nodiscard]] studies::OutageReport judged() const {
    return studies::judge_outages(question_, plans_, results_, motion_);
  }
  static double at_end(const studies::OutageFinding& f, studies::PoseEstimator t) {
    const auto& e = f.at_end[static_cast<std::size_t>(t)];
    return e ? e->horizontal_m : -1.0;
  }

  studies::OutageQuestion question_;
  std::vector<studies::OutagePlan> plans_;
  std::vector<drills::DrillResult> results_;
  studies::RecordedMotion motion_;
};

TEST_F(OneOutage, IsComparedWithGroundTruthAndWithDeadReckoning) {
  const studies::OutageReport report = judged();
  ASSERT_EQ(report.findings.size(), 1U);
  const studies::OutageFinding& f = report.findings[0];
  EXPECT_EQ(f.failed, "");
  EXPECT_NEAR(f.driven_m, 100.0, 0.5);
  EXPECT_NEAR(at_end(f, studies::PoseEstimator::kWm), 3.0, 1e-9);
  EXPECT_NEAR(f.at_end[0]->vertical_m, 4.0, 1e-9);
  EXPECT_NEAR(at_end(f, studies::PoseEstimator::kWmWithGps), 0.0, 1e-9);
  EXPECT_NEAR(at_end(f, studies::PoseEstimator::kWheels), 2.0, 1e-6);
  EXPECT_EQ(at_end(f, studies::PoseEstimator::kInertial), -1.0) << "no inertial data";
  EXPECT_NEAR(f.sigma_m, 0.1, 1e-9);
  ASSERT_TRUE(f.to_fix_m);
  EXPECT_NEAR(*f.to_fix_m, 4.0, 0.02);
  EXPECT_EQ(*f.fix_sigma_m, 0.7);
  ASSERT_TRUE(f.at_log_end);
  EXPECT_NEAR(f.at_log_end->horizontal_m, 0.0, 1e-9);
  ASSERT_EQ(report.closures.size(), 1U);
  EXPECT_NEAR(*report.closures[0].m[0], 400.0, 0.01) << "from the first fix, at 20 s";
  EXPECT_NEAR(*report.closures[0].m[static_cast<std::size_t>(studies::PoseEstimator::kWheels)],
              10.2 * 40.05, 1e-6);

  const std::string table = to_text(outage_table(report));
  EXPECT_THAT(table, HasSubstr("10 s"));
  EXPECT_THAT(table, HasSubstr("3.00/3.00"));
  EXPECT_THAT(to_text(studies::cut_table(report)), HasSubstr("wheels alone"));
  const auto json = to_json(report);
  EXPECT_EQ(json["groups"][0]["horizontal_m"]["WM"]["worst"], 3.0);
  EXPECT_EQ(json["reference"], "SIM_TRUTH of the log");
}

TEST_F(OneOutage, TheLadarAloneStartsFromTheBeliefAndEndsWithItsMap) {
  EXPECT_NEAR(at_end(judged().findings[0], studies::PoseEstimator::kLadar), 1.0, 1e-6);
  for (drills::DrillMatch& m : results_.back().shown->matches) {
    m.epoch = time_s(m.stamp) < 35.0 ? 1 : 2;
  }
  EXPECT_EQ(at_end(judged().findings[0], studies::PoseEstimator::kLadar), -1.0)
      << "a new map epoch began";
}

TEST_F(OneOutage, WithoutAPoseItIsNotCountedAndHasAReason) {
  motion_.has_truth = false;
  auto& beliefs = results_[1].shown->beliefs;
  const auto late = [](const drills::DrillBelief& b) { return time_s(b.stamp) > 30.5; };
  beliefs.erase(std::find_if(beliefs.begin(), beliefs.end(), late), beliefs.end());
  const studies::OutageReport report = judged();
  EXPECT_THAT(report.findings[0].failed, HasSubstr("at the end"));
  EXPECT_THAT(report.reference, HasSubstr("belief of WM"));
  EXPECT_THAT(to_text(outage_table(report)), HasSubstr("0 of 1"));
  EXPECT_EQ(to_json(report)["groups"][0]["evaluated"], 0);
  beliefs.clear();
  EXPECT_THAT(judged().findings[0].failed, HasSubstr("at the begin"));
  results_[1].shown.reset();
  results_[1].error = "no sensor data";
  EXPECT_EQ(judged().findings[0].failed, "no sensor data");
}

}  // namespace
}  // namespace rcs::test

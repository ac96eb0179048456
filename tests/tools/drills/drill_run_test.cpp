// One run of a drill, and the wrong a priori map.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <vector>

#include "lcmtypes/rcs/innovation_t.hpp"
#include "tests/tools/drills/drill_fixture.h"
#include "tools/drills/drill_campaign.h"
#include "tools/drills/drill_metrics.h"
#include "tools/drills/drill_run.h"

namespace rcs::test {
namespace {

class DrillRunTest : public testing::Test {
 protected:
  static std::string config(const std::string& path) {
    const char* root = std::getenv("RCS_SOURCE_DIR");
    return std::string(root == nullptr ? "." : root) + "/config/" + path;
  }
  drills::DrillRecord run(const drills::Drill& drill, drills::Withheld withheld) {
    drills::DrillRunOptions options;
    options.withheld = withheld;
    options.stop = [] { return false; };
    Result<drills::DrillRunResult> result =
        drills::run_drill(drill, vehicle_.value(), &scene_, options);
    RCS_CHECK(result.ok());
    return std::move(result->record);
  }
  static int after(const drills::DrillRecord& r, double t_s, int source) {
    int count = 0;
    for (const drills::DrillInnovation& i : r.innovations) {
      const bool late = seconds(i.stamp - *r.begin) > t_s && seconds(i.stamp - *r.begin) < 11.9;
      count += late && i.source == source ? 1 : 0;
    }
    return count;
  }

  Result<drills::DrillVehicle> vehicle_ = drills::load_drill_vehicle(config("demo3.toml"));
  drills::Scene scene_{drills::SceneKey{"", config("sim/drill.toml"), "", 1}};
};

TEST_F(DrillRunTest, ABaselineLacksItsSourceFromTheBeginningOfTheDrill) {
  ASSERT_TRUE(vehicle_.ok());
  drills::Drill drill;
  drills::Stimulus ramp;
  ramp.kind = drills::StimulusKind::kRamp;
  ramp.begin_s = 8.0;
  ramp.length_s = 2.0;
  drill.stimuli = {ramp};
  drill.run.length_s = 12.0;
  scene_.add_user(drill.run.length_s);
  constexpr int kGps = innovation_t::SOURCE_GPS_POSITION;
  constexpr int kRolling = innovation_t::SOURCE_ROLLING;
  constexpr int kOdometry = innovation_t::SOURCE_ODOMETRY;
  const drills::DrillRecord all = run(drill, drills::Withheld::kNothing);
  EXPECT_GT(after(all, 8.5, kGps), 10);
  EXPECT_GT(after(all, 8.5, kRolling), 20);
  const drills::DrillRecord no_gps = run(drill, drills::Withheld::kGps);
  EXPECT_EQ(after(no_gps, 8.5, kGps), 0);
  EXPECT_GT(after(no_gps, 8.5, kRolling), 20);
  const drills::DrillRecord no_ladar = run(drill, drills::Withheld::kLadar);
  EXPECT_EQ(after(no_ladar, 8.5, kRolling), 0);
  EXPECT_GT(after(no_ladar, 8.5, kGps), 10);
  const drills::DrillRecord inertial = run(drill, drills::Withheld::kLadarOdometryAndGps);
  EXPECT_EQ(
      after(inertial, 8.5, kGps) + after(inertial, 8.5, kRolling) + after(inertial, 8.5, kOdometry),
      0);
  EXPECT_EQ(after(inertial, 4.0, kGps), after(no_gps, 4.0, kGps))
      << "until then the source was available";
}

TEST_F(DrillRunTest, TheProgressOfACampaignIsTheShareOfItsRuns) {
  ASSERT_TRUE(vehicle_.ok());
  drills::DrillCampaign campaign;
  campaign.vehicle = vehicle_.value();
  campaign.scenario = config("sim/drill.toml");
  campaign.seeds = 1;
  campaign.keep_records = false;
  campaign.drills.resize(2);
  for (drills::Drill& drill : campaign.drills) drill.run.length_s = 3.0;
  campaign.stop = [] { return false; };
  double newest = 0.0;
  campaign.progress = [&newest](double share) {
    EXPECT_GE(share, newest);
    newest = share;
  };
  std::vector<double> after_run;
  campaign.look = [&](std::size_t, std::size_t, const drills::DrillRecord&) {
    after_run.push_back(newest);
  };
  const Result<std::vector<drills::DrillResult>> done = drills::run_campaign(campaign);
  ASSERT_TRUE(done.ok());
  ASSERT_EQ(after_run.size(), 2U);
  EXPECT_LE(after_run[0], 0.5);
  EXPECT_GT(after_run[0], 0.4);
  EXPECT_DOUBLE_EQ(newest, 1.0);
}

TEST(DrillWrongMap, IsTurnedAboutTheOriginAndShifted) {
  sim::PriorMap right;
  right.frame.datum = datum();
  right.raster.level.cell_m = 5.0;
  right.raster.width = right.raster.height = 40;
  right.raster.first = {-20, -20};
  // A slope to the east.
  for (int k = 0; k < 1600; ++k) {
    right.raster.z_m.push_back(static_cast<float>(0.1 * (-97.5 + 5.0 * (k % 40))));
  }
  const sim::PriorMap shifted = drills::wrong_map(right, Vec3(2.0, 0.0, 1.0), 0.0);
  EXPECT_EQ(shifted.raster.level.origin_m.x(), 2.0);
  EXPECT_NEAR(shifted.raster.z_m[0], right.raster.z_m[0] + 1.0F, 1e-5);
  // Rotated by a quarter turn it rises to the north.
  const sim::PriorMap turned = drills::wrong_map(right, Vec3::Zero(), radians(90.0));
  const Result<ElevationMap> map = ElevationMap::from_rasters(turned.frame, {turned.raster});
  ASSERT_TRUE(map.ok());
  Elevation there;
  ASSERT_TRUE(map->sample(10.0, 40.0, &there));
  EXPECT_NEAR(there.z_m, 4.0, 0.05);
}

drills::Stimulus without_gps(double begin_s, double length_s) {
  return drills::dropout(drills::DrillSource::kGps, begin_s, length_s);
}

bool reports(const drills::DrillRecord& record, const std::string& code, const std::string& text) {
  return std::any_of(record.events.begin(), record.events.end(), [&](const drills::DrillEvent& e) {
    return e.code == code && e.text.find(text) != std::string::npos;
  });
}

/// Largest horizontal error from 25 s on.
double worst_m(const drills::DrillRecord& record) {
  const drills::DrillErrors errors(record);
  double worst = 0.0;
  for (const drills::DrillIntegrity& i : record.integrity) {
    const std::optional<drills::DrillError> e = errors.at(i.stamp);
    if (e && errors.time_s(i.stamp) > 25.0) worst = std::max(worst, e->horizontal_m());
  }
  return worst;
}

// A stamp that is wrong by 0.44 s is 3 m along the path: INS and LADAR contradict each other in
// every curve, and one of them is excluded.
TEST_F(DrillRunTest, AStepOfTheClockOfTheLadarIsCorrected) {
  ASSERT_TRUE(vehicle_.ok());
  for (const double step_s : {-0.44, 0.44}) {
    drills::Drill drill;
    drills::Stimulus clock;
    clock.kind = drills::StimulusKind::kClock;
    clock.source = drills::DrillSource::kLadar;
    clock.begin_s = 35.0;
    clock.length_s = 12.0;
    clock.jump_s = step_s;
    drill.stimuli = {without_gps(30.0, 22.0), clock};
    drill.run.length_s = 55.0;
    scene_.add_user(drill.run.length_s);
    const drills::DrillRecord record = run(drill, drills::Withheld::kNothing);
    EXPECT_TRUE(reports(record, "scan.clock", step_s < 0.0 ? "by 0.44" : "by -0.44")) << step_s;
    EXPECT_FALSE(reports(record, "fde", "INS excluded")) << step_s;
    EXPECT_LT(worst_m(record), 2.0) << step_s;
  }
}

// Forces times 0.62 move the prediction of a scan by more than a metre within half a second;
// nothing matches there.
TEST_F(DrillRunTest, WrongForcesOfTheInsDoNotCostTheMap) {
  ASSERT_TRUE(vehicle_.ok());
  drills::Drill drill;
  drills::Stimulus forces;
  forces.kind = drills::StimulusKind::kScale;
  forces.source = drills::DrillSource::kIns;
  forces.begin_s = 35.0;
  forces.length_s = 5.0;
  forces.accel_factor = 0.62;
  drill.stimuli = {without_gps(30.0, 15.0), forces};
  drill.run.length_s = 50.0;
  scene_.add_user(drill.run.length_s);
  const drills::DrillRecord record = run(drill, drills::Withheld::kNothing);
  EXPECT_TRUE(reports(record, "fde", "INS excluded"));
  EXPECT_FALSE(reports(record, "map.reseeded", ""));
  EXPECT_LT(worst_m(record), 3.0);
}

// Without the registration of a scan deskewed by its own motion, the coarse search and the restart
// of a lost solution, runs like this one ended hundreds of metres away (ADR 71).
TEST_F(DrillRunTest, ALongLossOfInsAndGpsOnRoughGroundIsSurvived) {
  ASSERT_TRUE(vehicle_.ok());
  drills::Drill drill;
  drills::Stimulus zero;
  zero.kind = drills::StimulusKind::kZero;
  zero.source = drills::DrillSource::kIns;
  zero.begin_s = 45.0;
  zero.length_s = 25.0;
  drills::Stimulus outage;
  outage.kind = drills::StimulusKind::kDropout;
  outage.source = drills::DrillSource::kGps;
  outage.begin_s = 40.0;
  outage.length_s = 35.0;
  drill.stimuli = {outage, zero};
  drill.run.length_s = 87.0;
  scene_.add_user(drill.run.length_s);
  const drills::DrillRecord record = run(drill, drills::Withheld::kNothing);
  const drills::DrillErrors errors(record);
  double worst_m = 0.0;
  double end_m = 0.0;
  for (const drills::DrillIntegrity& i : record.integrity) {
    const std::optional<drills::DrillError> e = errors.at(i.stamp);
    if (!e) continue;
    worst_m = std::max(worst_m, e->horizontal_m());
    if (errors.time_s(i.stamp) > 82.0) end_m = std::max(end_m, e->horizontal_m());
  }
  EXPECT_GT(worst_m, 0.1) << "something was measured";
  EXPECT_LT(worst_m, 15.0);
  EXPECT_LT(end_m, 2.0) << "7 s after GPS is received again";
}

}  // namespace
}  // namespace rcs::test

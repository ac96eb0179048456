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
  drills::DrillRecord run(const drills::Drill& drill, drills::Denied denied) {
    drills::DrillRunOptions options;
    options.denied = denied;
    options.stop = [] { return false; };
    Result<drills::DrillRunResult> result =
        drills::run_drill(drill, vehicle_.value(), &*scene_, options);
    RCS_CHECK(result.ok());
    return std::move(result->record);
  }
  /// All sensors, with these faults.
  drills::DrillRecord run(const std::vector<drills::Stimulus>& faults, double length_s) {
    drills::Drill drill;
    drill.stimuli = faults;
    drill.run.length_s = length_s;
    scene_->add_user(length_s);
    return run(drill, drills::Denied::kNothing);
  }
  /// The same with the noise of this seed.
  drills::DrillRecord run(const std::vector<drills::Stimulus>& faults, double length_s, int seed) {
    scene_.emplace(drills::SceneKey{"", config("sim/drill.toml"), "", seed});
    return run(faults, length_s);
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
  std::optional<drills::Scene> scene_{std::in_place,
                                      drills::SceneKey{"", config("sim/drill.toml"), "", 1}};
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
  scene_->add_user(drill.run.length_s);
  constexpr int kGps = innovation_t::SOURCE_GPS_POSITION;
  constexpr int kRolling = innovation_t::SOURCE_ROLLING;
  constexpr int kOdometry = innovation_t::SOURCE_ODOMETRY;
  const drills::DrillRecord all = run(drill, drills::Denied::kNothing);
  EXPECT_GT(after(all, 8.5, kGps), 10);
  EXPECT_GT(after(all, 8.5, kRolling), 20);
  const drills::DrillRecord no_gps = run(drill, drills::Denied::kGps);
  EXPECT_EQ(after(no_gps, 8.5, kGps), 0);
  EXPECT_GT(after(no_gps, 8.5, kRolling), 20);
  const drills::DrillRecord no_ladar = run(drill, drills::Denied::kLadar);
  EXPECT_EQ(after(no_ladar, 8.5, kRolling), 0);
  EXPECT_GT(after(no_ladar, 8.5, kGps), 10);
  const drills::DrillRecord inertial = run(drill, drills::Denied::kLadarOdometryAndGps);
  EXPECT_EQ(
      after(inertial, 8.5, kGps) + after(inertial, 8.5, kRolling) + after(inertial, 8.5, kOdometry),
      0);
  EXPECT_EQ(after(inertial, 4.0, kGps), after(no_gps, 4.0, kGps))
      << "until then the source was available";
}

TEST_F(DrillRunTest, AStimulusAfterTheEndOfTheDriveIsAnError) {
  drills::Drill drill;
  drill.stimuli = {drills::dropout(drills::DrillSource::kGps, 350.0, 10.0)};
  drill.run.length_s = 5.0;
  scene_->add_user(5.0);
  drills::DrillRunOptions options;
  options.stop = [] { return false; };
  const Result<drills::DrillRunResult> result =
      drills::run_drill(drill, vehicle_.value(), &*scene_, options);
  ASSERT_FALSE(result.ok());
  EXPECT_NE(result.error().message.find("'gps dropout' begins at 350 s, and the drive ends at"),
            std::string::npos)
      << result.error().message;
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

drills::Stimulus fault(drills::StimulusKind kind, drills::DrillSource source, double begin_s,
                       double length_s) {
  drills::Stimulus out;
  out.kind = kind;
  out.source = source;
  out.begin_s = begin_s;
  out.length_s = length_s;
  return out;
}

drills::Stimulus without_gps(double begin_s, double length_s) {
  return drills::dropout(drills::DrillSource::kGps, begin_s, length_s);
}

bool reports(const drills::DrillRecord& record, const std::string& code, const std::string& text) {
  return std::any_of(record.events.begin(), record.events.end(), [&](const drills::DrillEvent& e) {
    return e.code == code && e.text.find(text) != std::string::npos;
  });
}

/// Largest horizontal error from then on.
double worst_m(const drills::DrillRecord& record, double from_s = 25.0) {
  const drills::DrillErrors errors(record);
  double worst = 0.0;
  for (const drills::DrillIntegrity& i : record.integrity) {
    const std::optional<drills::DrillError> e = errors.at(i.stamp);
    if (e && errors.time_s(i.stamp) > from_s) worst = std::max(worst, e->horizontal_m());
  }
  return worst;
}

// A stamp that is wrong by 0.44 s is 3 m along the path: INS and LADAR contradict each other in
// every curve, and one of them is excluded.
TEST_F(DrillRunTest, AStepOfTheClockOfTheLadarIsCorrected) {
  ASSERT_TRUE(vehicle_.ok());
  for (const double step_s : {-0.44, 0.44}) {
    drills::Stimulus clock =
        fault(drills::StimulusKind::kClock, drills::DrillSource::kLadar, 35.0, 12.0);
    clock.jump_s = step_s;
    const drills::DrillRecord record = run({without_gps(30.0, 22.0), clock}, 55.0);
    EXPECT_TRUE(reports(record, "scan.clock", step_s < 0.0 ? "by 0.44" : "by -0.44")) << step_s;
    EXPECT_FALSE(reports(record, "fde", "INS excluded")) << step_s;
    EXPECT_LT(worst_m(record), 2.0) << step_s;
  }
}

// Forces times 0.62 move the prediction of a scan by more than a metre within half a second;
// nothing matches there.
TEST_F(DrillRunTest, WrongForcesOfTheInsDoNotCostTheMap) {
  ASSERT_TRUE(vehicle_.ok());
  drills::Stimulus forces =
      fault(drills::StimulusKind::kScale, drills::DrillSource::kIns, 35.0, 5.0);
  forces.accel_factor = 0.62;
  const drills::DrillRecord record = run({without_gps(30.0, 15.0), forces}, 50.0);
  EXPECT_TRUE(reports(record, "fde", "INS excluded"));
  EXPECT_FALSE(reports(record, "map.reseeded", ""));
  EXPECT_LT(worst_m(record), 3.0);
}

// At 10 m/s the first scans after 1 s without any sensor lie on the map by 30 % only. If they are
// rejected, a later one matches 5 % of its points by chance, 13 deg off (ADR 104).
TEST_F(DrillRunTest, ASilenceOfAllSensorsAtSpeedDoesNotTurnTheHeading) {
  ASSERT_TRUE(vehicle_.ok());
  const drills::Stimulus silence =
      fault(drills::StimulusKind::kDropout, drills::DrillSource::kAll, 45.0, 1.0);
  const drills::DrillRecord record = run({without_gps(35.0, 60.0), silence}, 60.0, 218);
  EXPECT_GT(worst_m(record), 0.1) << "something was measured";
  EXPECT_LT(worst_m(record), 3.0);
}

// At the end of a scan an error of the velocity with which it is deskewed moves the pose by half of
// its distance in the scan, and the next velocity by the opposite: the poses of a rocking vehicle
// alternated by metres, and the errors of these drives were 18 and 9 m (ADR 111). A single error
// varies with every change of the filter (1 to 6 m on 12 other seeds, mean 2.5 m): their mean is
// tested.
TEST_F(DrillRunTest, ALongLossOfInsAndGpsOnRoughGroundIsSurvived) {
  ASSERT_TRUE(vehicle_.ok());
  const drills::Stimulus zero =
      fault(drills::StimulusKind::kZero, drills::DrillSource::kIns, 45.0, 25.0);
  double sum_m = 0.0;
  for (const int seed : {11, 17}) {
    const drills::DrillRecord record = run({without_gps(40.0, 35.0), zero}, 87.0, seed);
    EXPECT_GT(worst_m(record), 0.1) << "something was measured";
    sum_m += worst_m(record);
    EXPECT_LT(worst_m(record, 82.0), 2.0) << "7 s after GPS is received again";
  }
  EXPECT_LT(0.5 * sum_m, 5.0) << "2 % of the distance";
}

}  // namespace
}  // namespace rcs::test

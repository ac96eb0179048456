// One run of a drill, and the wrong a priori map.

#include <gtest/gtest.h>

#include <cstdlib>
#include <vector>

#include "lcmtypes/rcs/innovation_t.hpp"
#include "tests/tools/drills/drill_fixture.h"
#include "tools/drills/drill_campaign.h"
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

}  // namespace
}  // namespace rcs::test

// A start without GPS in the reference simulation: SP searches on the a priori map, and WM's frame
// world begins at the pose that SP finds.
#include <gtest/gtest.h>

#include <map>
#include <utility>

#include "lcmtypes/channels.h"
#include "lcmtypes/convert.h"
#include "lcmtypes/rcs/nav_state_t.hpp"
#include "lcmtypes/rcs/truth_t.hpp"
#include "modules/sp/sp_node.h"
#include "modules/wm/wm_node.h"
#include "rcs/node/bus/local_bus.h"
#include "rcs/node/bus/tap.h"
#include "rcs/node/executor.h"
#include "rcs/node/timeline/lockstep_timeline.h"
#include "sim/scenario_file.h"
#include "sim/simulator.h"
#include "tests/replay/chain.h"

namespace rcs {
namespace {

struct StartRun {
  bool world_valid = false;
  double error_m = 0.0, error_rad = 0.0, sigma_m = 0.0;
  double matched_ago_s = -1.0;
};

/// @param off_m  distance of the middle of the region east of the vehicle's start
StartRun start(double off_m) {
  sim::ScenarioOverrides overrides;
  overrides.seed = 2;
  overrides.duration_s = 24.0;
  overrides.gps_outage = sim::Outage{0.0, 1000.0};
  Result<sim::Scenario> scenario =
      sim::load_scenario(test::source_path("config/sim/rocky_hills.toml"), overrides);
  RCS_CHECK(scenario.ok());
  scenario->prior_map.cell_m = 1.0;
  scenario->prior_map.sigma_m = 0.2;
  scenario->prior_map.margin_m = 220.0;
  sim::Simulator simulator(*scenario);
  const sim::PriorMap survey = simulator.prior_map();
  Result<ElevationMap> map = ElevationMap::from_rasters(survey.frame, {survey.raster});
  RCS_CHECK(map.ok());

  const Result<ParamFile> file = ParamFile::load(test::source_path("config/demo3.toml"));
  RCS_CHECK(file.ok());
  Result<sp::SpConfig> sp_config = sp::load_sp_config(*file);
  Result<wm::WmConfig> wm_config = wm::load_wm_config(*file);
  RCS_CHECK(sp_config.ok() && wm_config.ok());
  sp_config->datum = wm_config->datum = survey.frame.datum;
  sp::StartPlace place;
  place.place = LocalFrame(survey.frame.datum).to_geodetic({off_m, -30.0, 0.0});
  place.heading_rad = radians(90.0 - 63.4 + 12.0);  // the course begins towards (30, 60)
  sp_config->start = place;

  LocalBus bus;
  sp::SpNode sp_node(*sp_config, PriorTerrain(std::move(map).value(), nullptr), &bus);
  wm::WmNode wm_node(*wm_config, &bus);
  std::map<std::int64_t, Pose> truth;
  nav_state_t newest{};
  const Tap<truth_t> truths(&bus, channel::kSimTruth, [&](const truth_t& m, Stamp) {
    Pose T;
    if (from_message(m.q_world_vehicle, m.p_world_vehicle_m, &T)) truth[m.utime] = T;
  });
  const Tap<nav_state_t> beliefs(&bus, channel::kWmNavState,
                                 [&](const nav_state_t& m, Stamp) { newest = m; });
  LockstepTimeline timeline(&bus, &simulator, kReplayTail);
  run({&sp_node, &wm_node}, timeline, nullptr);

  StartRun out;
  out.world_valid = newest.world_valid != 0;
  out.matched_ago_s = 1e-6 * static_cast<double>(newest.age_prior_map_us);
  const auto at = truth.lower_bound(newest.utime);
  Pose T;
  if (at == truth.end() || !from_message(newest.q_world_vehicle, newest.p_world_vehicle_m, &T)) {
    ADD_FAILURE() << "no pose, or no ground truth for it";
    return out;
  }
  out.error_m = (T.p - at->second.p).norm();
  out.error_rad = std::abs(wrap_angle(yaw_of(T.q) - yaw_of(at->second.q)));
  out.sigma_m = std::sqrt(newest.cov_world_pose[0][0] + newest.cov_world_pose[1][1] +
                          newest.cov_world_pose[2][2]);
  return out;
}

TEST(StartWithoutGps, FrameWorldBeginsAtThePoseThatTheSearchFinds) {
  const StartRun run = start(40.0);
  ASSERT_TRUE(run.world_valid);
  // The error includes the survey's systematic error of 0.3 m, and the covariance covers it.
  EXPECT_LT(run.error_m, 2.0);
  EXPECT_LT(run.error_m, 3.0 * run.sigma_m);
  EXPECT_LT(run.sigma_m, 3.0);
  EXPECT_LT(run.error_rad, radians(1.0));
  // From then on single scans are matched to the map.
  EXPECT_GE(run.matched_ago_s, 0.0);
  EXPECT_LT(run.matched_ago_s, 3.0);
  std::printf("error %.2f m and %.2f deg, sigma %.2f m\n", run.error_m, degrees(run.error_rad),
              run.sigma_m);
}

TEST(StartWithoutGps, FrameWorldStaysUnknownOutsideTheSearchRegion) {
  EXPECT_FALSE(start(180.0).world_valid);
}

}  // namespace
}  // namespace rcs

// A resting scanner before ground that hardly determines its position: the side of a dry lake, with
// low grass (config/sim/mission.toml, x = 664 m).

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>

#include "modules/registration/point_to_plane_icp.h"
#include "modules/registration/voxel_sampler.h"
#include "sim/scenario_file.h"
#include "tests/support/still_scan.h"
#include "tools/studies/simulated_scans.h"

namespace rcs {
namespace {

// The cost of the matches has many minima here. A search that walks through them ends up to 1 m
// away, and the map, in which the scans are inserted there, has a minimum there from then on.
TEST(RestingScanner, StaysWhereItIs) {
  const char* const root = std::getenv("RCS_SOURCE_DIR");
  const Result<sim::Scenario> loaded = sim::load_scenario(
      std::string(root == nullptr ? "." : root) + "/config/sim/mission.toml", {});
  ASSERT_TRUE(loaded.ok());
  const sim::Scenario& scenario = *loaded;
  const sim::World world(scenario.world, scenario.dem, {Vec2(660.0, 0.0), Vec2(661.0, 0.0)}, 120.0);
  const sim::MountParams mount = studies::without_error(scenario.mount);
  const sp::Calibration calibration(studies::ladar_in_mount(scenario));
  const Pose T_world_vehicle = test::T_world_standing(world, Vec2(664.36, 1.52), radians(192.8));

  registration::RollingMapParams map_params;  // as in config/demo3.toml
  map_params.voxel_m = 0.7;
  registration::IcpParams params;
  params.beam_sigma_rad = radians(0.03);
  params.map_sigma_m = params.min_map_sigma_m = 0.08;
  registration::Prediction prediction;
  prediction.covariance.diagonal() << Vec3::Constant(1e-4), Vec3::Constant(1e-6);

  registration::IcpWorkspace workspace;
  registration::VoxelSampler sampler;
  double square_sum = 0.0;
  double largest_m = 0.0;
  int used = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    sim::RangeImager imager(scenario.imager, scenario.beam, mount, seed);
    registration::RollingMap map(map_params);
    for (int k = 0; k < 20; ++k) {
      const Points seen = test::image_at_rest(world, T_world_vehicle, calibration, &imager);
      Points scan;
      for (std::size_t i = 0; i < seen.size(); ++i) {
        scan.push_back((mount.T_vehicle_mount * seen[i].cast<double>()).cast<float>());
      }
      Points dense;
      Points source;
      sampler.sample(scan, 0.1, &dense);
      sampler.sample(dense, 0.3, &source);
      Pose T;
      if (k > 0) {
        const registration::Registration r = registration::register_points(
            source, &map, prediction, params, 1'000'000'000, &workspace);
        T = registration::fused_pose(prediction, r);
        if (!usable(r.stop)) continue;
        const double error_m = r.T_target_vehicle.p.head<2>().norm();
        square_sum += error_m * error_m;
        largest_m = std::max(largest_m, error_m);
        ++used;
      }
      map.insert(dense, T);
    }
  }
  ASSERT_GT(used, 180);
  EXPECT_LT(std::sqrt(square_sum / used), 0.2);
  EXPECT_LT(largest_m, 0.8);
}

}  // namespace
}  // namespace rcs

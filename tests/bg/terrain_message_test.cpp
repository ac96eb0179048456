// Terrain as BG reads it from WM_MAP_PATCH.

#include <gtest/gtest.h>

#include <chrono>
#include <limits>

#include "modules/bg/bg_messages_node.h"

namespace rcs::bg {
namespace {

TEST(ReadTerrain, TheRisesOfTheGroundFollowFromTheHeights) {
  map_patch_t m{};
  m.utime = 1'000'000;
  m.cell_m = 0.4;
  m.width = 5;
  m.height = 4;
  m.n = m.width * m.height;
  const auto n = static_cast<std::size_t>(m.n);
  m.step_cm.resize(n);
  m.slope_deg.resize(n);
  m.roughness_cm.resize(n);
  m.flags.resize(n);
  for (int j = 0; j < m.height; ++j) {
    for (int i = 0; i < m.width; ++i) {
      m.height_cm.push_back(static_cast<std::int16_t>(8 * i - 4 * j));
    }
  }
  m.flags[7] = map_patch_t::FLAG_UNKNOWN;  // i = 2, j = 1
  // Hidden by an edge: an obstacle whose height is not known.
  m.flags[19] = map_patch_t::FLAG_OBSTACLE | map_patch_t::FLAG_HIDDEN;  // i = 4, j = 3
  m.height_cm[19] = -32768;
  vj::Terrain terrain;
  ASSERT_TRUE(read_terrain(m, &terrain));
  for (std::size_t k = 0; k < n; ++k) {
    const bool beside_unknown_x = k == 6 || k == 8 || k == 18 || k == 19;
    const bool beside_unknown_y = k == 2 || k == 12 || k == 14 || k == 19;
    EXPECT_NEAR(terrain.ground[k].rise_x, beside_unknown_x ? 0.0 : 0.2, 1e-5) << k;
    EXPECT_NEAR(terrain.ground[k].rise_y, beside_unknown_y ? 0.0 : -0.1, 1e-5) << k;
  }
}

TEST(ReadTerrain, APlanOverAnUnknownHeightHasThatOfTheVehicle) {
  vj::Terrain terrain;
  terrain.cell_m = 0.4;
  terrain.width = terrain.height = 1;
  terrain.ground.resize(1);
  terrain.ground[0].known = true;
  terrain.ground[0].height_m = std::numeric_limits<float>::quiet_NaN();
  Path path(1);
  path[0].place = {0.2, 0.2, 0.0, 0.0};
  path[0].cause = vj::SpeedCause::kSteering;
  plan_t plan;
  write_plan(path, terrain, 12.5, Stamp(std::chrono::seconds(1)), &plan);
  EXPECT_EQ(plan.point[0].p_m[2], 12.5);
  EXPECT_EQ(plan.point[0].limit, +plan_point_t::LIMIT_STEERING);
}

}  // namespace
}  // namespace rcs::bg

// Terrain as BG reads it from WM_MAP_PATCH.

#include <gtest/gtest.h>

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
  vj::Terrain terrain;
  ASSERT_TRUE(read_terrain(m, &terrain));
  for (std::size_t k = 0; k < n; ++k) {
    const bool beside_unknown_x = k == 6 || k == 7 || k == 8;
    const bool beside_unknown_y = k == 2 || k == 7 || k == 12;
    EXPECT_NEAR(terrain.ground[k].rise_x, beside_unknown_x && k != 7 ? 0.0 : 0.2, 1e-5) << k;
    EXPECT_NEAR(terrain.ground[k].rise_y, beside_unknown_y && k != 7 ? 0.0 : -0.1, 1e-5) << k;
  }
}

}  // namespace
}  // namespace rcs::bg

#include "rcs/zones/zone_raster.h"

#include <gtest/gtest.h>

#include "tests/support/heap_guard.h"
#include "tests/zones/random_zones.h"

namespace rcs {
namespace {

ZoneWindow window(double yaw_rad, const Vec2& origin_m) {
  return {0.4, {-70, -55}, 150, 140, yaw_rad, origin_m};
}

Vec2 centre_world(const ZoneWindow& w, int i, int j) {
  const Vec2 p((w.first.i + i + 0.5) * w.cell_m, (w.first.j + j + 0.5) * w.cell_m);
  return Eigen::Rotation2Dd(-w.yaw_rad) * (p - w.origin_m);
}

// For every cell, also with a negative clearance and in a turned frame.
TEST(ZoneRaster, AgreesWithTheClearanceOfEachCell) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> turn(-kPi, kPi);
  std::uniform_real_distribution<double> shift(-40.0, 40.0);
  std::uniform_real_distribution<double> limit(-6.0, 8.0);
  ZoneRaster raster;
  int forbidden = 0;
  int allowed = 0;
  for (int scene = 0; scene < 40; ++scene) {
    const Zones zones(test::random_zones(1 + scene % 8, &rng));
    const ZoneWindow w = window(turn(rng), {shift(rng), shift(rng)});
    const double clearance_m = scene % 5 == 0 ? 0.0 : limit(rng);
    const std::vector<std::uint8_t>& cells = raster.forbidden(zones, w, clearance_m);
    ASSERT_EQ(cells.size(), std::size_t{150} * 140);
    for (int j = 0; j < w.height; ++j) {
      for (int i = 0; i < w.width; ++i) {
        const double m = zones.clearance(centre_world(w, i, j)).m;
        if (std::abs(m - clearance_m) < 1e-6) continue;
        const bool found = cells[static_cast<std::size_t>(j * w.width + i)] != 0;
        ASSERT_EQ(found, m < clearance_m)
            << "scene " << scene << ", cell " << i << ", " << j << ": " << m << ", " << clearance_m;
        ++(found ? forbidden : allowed);
      }
    }
  }
  EXPECT_GT(forbidden, 100'000);
  EXPECT_GT(allowed, 100'000);
}

TEST(ZoneRaster, WithoutFenceAndKeepOutNothingIsForbidden) {
  ZoneRaster raster;
  for (const std::uint8_t cell : raster.forbidden(Zones(), window(0.3, {1.0, 2.0}), 5.0)) {
    ASSERT_EQ(cell, 0);
  }
}

TEST(ZoneRaster, AllocatesNothingAfterTheFirstWindow) {
  if (!test::HeapGuard::available()) GTEST_SKIP() << "SKIPPED: a sanitizer owns malloc";
  std::mt19937 rng(4);
  const Zones zones(test::random_zones(8, &rng));
  ZoneRaster raster;
  raster.forbidden(zones, window(0.0, {0.0, 0.0}), 1.0);
  const test::HeapGuard guard;
  for (int k = 0; k < 20; ++k) {
    raster.forbidden(zones, window(0.1 * k, {3.0, 1.0 * k}), 0.3 * k - 2);
  }
  EXPECT_EQ(guard.allocations(), 0);
}

}  // namespace
}  // namespace rcs

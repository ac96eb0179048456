#include "modules/bg/unchecked_ground.h"

#include <gtest/gtest.h>

namespace rcs::bg {
namespace {

SightParams sight() {
  SightParams params;
  params.far_m = 9.0;
  return params;
}

vj::Terrain known_ground() {
  vj::Terrain t;
  t.first = {-64, -64};
  t.width = t.height = 128;
  t.ground.resize(std::size_t{128} * 128);
  for (vj::Ground& g : t.ground) g.known = true;
  return t;
}

struct Drive {
  UncheckedGround unchecked{sight(), Shape{}};
  Place here;
  vj::Terrain terrain = known_ground();

  /// Ahead by `way_m`, negative: backwards, with a scan each 0.5 m or without.
  void go(double way_m, Scans scans) {
    for (double s = 0.0; s < std::abs(way_m); s += 0.5) {
      here = along_arc(here, way_m > 0.0 ? 0.5 : -0.5);
      stay(scans);
    }
  }
  void stay(Scans scans) {
    terrain = known_ground();
    unchecked.mark(here, scans, &terrain);
  }
  [[nodiscard]] bool blocked(double ahead_m, double left_m = 0.0) const {
    const double c = std::cos(here.heading_rad);
    const double s = std::sin(here.heading_rad);
    return terrain
        .at(terrain.cell_at(here.x_m + c * ahead_m - s * left_m,
                            here.y_m + s * ahead_m + c * left_m))
        .obstacle;
  }
  [[nodiscard]] int blocked_cells() const {
    int count = 0;
    for (const vj::Ground& g : terrain.ground) count += g.obstacle ? 1 : 0;
    return count;
  }
};

TEST(UncheckedGround, WithScansNothingIsUnchecked) {
  Drive drive;
  for (const double curvature_1pm : {0.0, 0.18, -0.18, 0.1}) {
    drive.here.curvature_1pm = curvature_1pm;
    for (int k = 0; k < 20; ++k) {
      drive.go(1.0, Scans::kNew);
      EXPECT_EQ(drive.blocked_cells(), 0);
    }
  }
}

TEST(UncheckedGround, SomeMissingScansAreNoLoss) {
  Drive drive;
  for (int k = 0; k < 10; ++k) {
    drive.go(1.0, Scans::kNew);
    drive.go(0.5, Scans::kNone);
    EXPECT_EQ(drive.blocked_cells(), 0);
  }
}

TEST(UncheckedGround, AfterADriveWithoutScansTheBlindZoneIsUnchecked) {
  Drive drive;
  drive.go(10.0, Scans::kNew);
  drive.go(4.0, Scans::kLost);
  EXPECT_FALSE(drive.blocked(4.0)) << "it had been seen from near";
  drive.go(4.0, Scans::kLost);
  EXPECT_TRUE(drive.blocked(5.0));
  EXPECT_FALSE(drive.blocked(1.0)) << "the vehicle stands there";
  EXPECT_FALSE(drive.blocked(9.0)) << "beyond the blind zone: a scan can still show it";
  // Scans from where the vehicle stands do not show its blind zone.
  for (int k = 0; k < 10; ++k) drive.stay(Scans::kNew);
  EXPECT_TRUE(drive.blocked(5.0));
}

TEST(UncheckedGround, ItIsCheckedByBackingAndLooking) {
  Drive drive;
  drive.go(10.0, Scans::kNew);
  drive.go(8.0, Scans::kLost);
  ASSERT_TRUE(drive.blocked(5.0));
  drive.go(-6.0, Scans::kNew);
  drive.go(6.0, Scans::kNew);
  EXPECT_FALSE(drive.blocked(5.0));
}

TEST(UncheckedGround, WhatTheVehicleDrivesOverIsChecked) {
  Drive drive;
  drive.go(10.0, Scans::kNew);
  drive.go(12.0, Scans::kLost);
  EXPECT_FALSE(drive.blocked(-3.0));
  EXPECT_TRUE(drive.blocked(-1.0, 2.0)) << "beside it no one has looked";
}

TEST(UncheckedGround, ItIsKeptWhenFrameLocalIsReplaced) {
  Drive drive;
  drive.go(10.0, Scans::kNew);
  drive.go(8.0, Scans::kLost);
  ASSERT_TRUE(drive.blocked(5.0));
  const int before = drive.blocked_cells();
  drive.here = Place{3.0, -2.0, 1.2, 0.0};
  drive.unchecked.move_to_frame_of(drive.here);
  drive.stay(Scans::kNew);
  EXPECT_TRUE(drive.blocked(5.0));
  EXPECT_FALSE(drive.blocked(-1.0));
  EXPECT_NEAR(drive.blocked_cells(), before, 0.1 * before);
}

TEST(UncheckedGround, WithoutTheRangeOfTheLadarNothingIsUnchecked) {
  Drive drive;
  drive.unchecked = UncheckedGround(SightParams{}, Shape{});
  drive.go(10.0, Scans::kNew);
  drive.go(12.0, Scans::kLost);
  EXPECT_EQ(drive.blocked_cells(), 0);
}

}  // namespace
}  // namespace rcs::bg

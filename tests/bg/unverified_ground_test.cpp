#include "modules/bg/unverified_ground.h"

#include <gtest/gtest.h>

#include "tests/bg/fields.h"

namespace rcs::bg {
namespace {

using test::sight;

vj::Terrain known_ground() {
  return test::level_field(128, [](double, double) { return false; });
}

struct Drive {
  UnverifiedGround unverified{sight(), Shape{}};
  Pose2d here;
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
    unverified.mark(here, scans, &terrain);
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

TEST(UnverifiedGround, WithScansNoGroundIsUnverified) {
  Drive drive;
  for (const double curvature_1pm : {0.0, 0.18, -0.18, 0.1}) {
    drive.here.curvature_1pm = curvature_1pm;
    for (int k = 0; k < 20; ++k) {
      drive.go(1.0, Scans::kNew);
      EXPECT_EQ(drive.blocked_cells(), 0);
    }
  }
}

TEST(UnverifiedGround, SomeMissingScansAreNoLoss) {
  Drive drive;
  for (int k = 0; k < 10; ++k) {
    drive.go(1.0, Scans::kNew);
    drive.go(0.5, Scans::kNone);
    EXPECT_EQ(drive.blocked_cells(), 0);
  }
}

TEST(UnverifiedGround, AfterADriveWithoutScansTheBlindZoneIsUnverified) {
  Drive drive;
  drive.go(10.0, Scans::kNew);
  drive.go(4.0, Scans::kLost);
  EXPECT_FALSE(drive.blocked(4.0)) << "it was observed at short range";
  drive.go(4.0, Scans::kLost);
  EXPECT_TRUE(drive.blocked(5.0));
  EXPECT_FALSE(drive.blocked(1.0)) << "the vehicle stands there";
  EXPECT_FALSE(drive.blocked(9.0)) << "outside of the blind zone a scan can still show it";
  // Scans from where the vehicle stands do not show its blind zone.
  for (int k = 0; k < 10; ++k) drive.stay(Scans::kNew);
  EXPECT_TRUE(drive.blocked(5.0));
}

TEST(UnverifiedGround, ReversingAndObservingVerifiesIt) {
  Drive drive;
  drive.go(10.0, Scans::kNew);
  drive.go(8.0, Scans::kLost);
  ASSERT_TRUE(drive.blocked(5.0));
  drive.go(-6.0, Scans::kNew);
  drive.go(6.0, Scans::kNew);
  EXPECT_FALSE(drive.blocked(5.0));
}

TEST(UnverifiedGround, GroundThatTheVehicleDrivesOverIsVerified) {
  Drive drive;
  drive.go(10.0, Scans::kNew);
  drive.go(12.0, Scans::kLost);
  EXPECT_FALSE(drive.blocked(-3.0));
  EXPECT_TRUE(drive.blocked(-1.0, 2.0)) << "next to it nothing was observed";
}

TEST(UnverifiedGround, ItIsKeptWhenFrameLocalIsReplaced) {
  Drive drive;
  drive.go(10.0, Scans::kNew);
  drive.go(8.0, Scans::kLost);
  ASSERT_TRUE(drive.blocked(5.0));
  const int before = drive.blocked_cells();
  drive.here = Pose2d{3.0, -2.0, 1.2, 0.0};
  drive.unverified.move_to_frame_of(drive.here);
  drive.stay(Scans::kNew);
  EXPECT_TRUE(drive.blocked(5.0));
  EXPECT_FALSE(drive.blocked(-1.0));
  EXPECT_NEAR(drive.blocked_cells(), before, 0.1 * before);
}

TEST(UnverifiedGround, WithoutTheRangeOfTheLadarNoGroundIsUnverified) {
  Drive drive;
  drive.unverified = UnverifiedGround(SightParams{}, Shape{});
  drive.go(10.0, Scans::kNew);
  drive.go(12.0, Scans::kLost);
  EXPECT_EQ(drive.blocked_cells(), 0);
}

}  // namespace
}  // namespace rcs::bg

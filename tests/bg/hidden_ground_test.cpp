#include "modules/bg/hidden_ground.h"

#include <gtest/gtest.h>

#include "tests/bg/fields.h"

namespace rcs::bg {
namespace {

using test::sight;

/// Known ground but for a strip across the way ahead, from `from_m` to `to_m`.
vj::Terrain terrain_with_strip(double from_m, double to_m) {
  vj::Terrain t;
  t.first = {-64, -64};
  t.width = t.height = 128;
  t.ground.resize(std::size_t{128} * 128);
  for (int j = 0; j < 128; ++j) {
    for (int i = 0; i < 128; ++i) {
      const double x_m = (t.first.i + i + 0.5) * t.cell_m;
      t.ground[static_cast<std::size_t>(j * 128 + i)].known = x_m < from_m || x_m > to_m;
    }
  }
  return t;
}

/// As many scans as it takes.
void look(HiddenGround* hidden, const Pose2d& vehicle, double pitch_rad, double roll_rad,
          vj::Terrain* terrain) {
  vj::Terrain first = *terrain;
  hidden->mark(vehicle, pitch_rad, roll_rad, true, &first);
  hidden->mark(vehicle, pitch_rad, roll_rad, true, terrain);
}

bool blocked(const vj::Terrain& t, double x_m) { return t.at(t.cell_at(x_m, 0.0)).obstacle; }

TEST(HiddenGround, GroundThatShouldBeSeenAndIsNotIsAnObstacle) {
  HiddenGround hidden(sight());
  vj::Terrain t = terrain_with_strip(8.0, 20.0);
  look(&hidden, {}, 0.0, 0.0, &t);
  EXPECT_TRUE(blocked(t, 8.6));
  EXPECT_FALSE(blocked(t, 12.0)) << "farther away it may still come into sight";
  EXPECT_FALSE(blocked(t, 4.0));
}

TEST(HiddenGround, WithoutTheRangeOfTheLadarNothingIsHidden) {
  HiddenGround hidden(SightParams{});
  vj::Terrain t = terrain_with_strip(8.0, 20.0);
  look(&hidden, {}, 0.0, 0.0, &t);
  EXPECT_FALSE(blocked(t, 8.6));
}

TEST(HiddenGround, TheBlindZoneIsNotHidden) {
  HiddenGround hidden(sight());
  vj::Terrain t = terrain_with_strip(1.0, 6.0);
  look(&hidden, {}, 0.0, 0.0, &t);
  EXPECT_FALSE(blocked(t, 4.0));
  // With the nose up, the lowest rays pass above the ground that is usually seen.
  HiddenGround up(sight());
  vj::Terrain crest = terrain_with_strip(6.0, 20.0);
  look(&up, {}, radians(11.0), 0.0, &crest);
  EXPECT_FALSE(blocked(crest, 8.6));
  // On a slope downhill, the blind zone is not smaller.
  HiddenGround down(sight());
  vj::Terrain slope = terrain_with_strip(1.0, 6.0);
  look(&down, {}, radians(-12.0), 0.0, &slope);
  EXPECT_FALSE(blocked(slope, 5.0));
}

TEST(HiddenGround, ItIsRememberedUntilItIsSeen) {
  HiddenGround hidden(sight());
  vj::Terrain t = terrain_with_strip(8.0, 20.0);
  look(&hidden, {}, 0.0, 0.0, &t);
  Pose2d aside;
  aside.heading_rad = 2.0;
  vj::Terrain again = terrain_with_strip(8.0, 20.0);
  look(&hidden, aside, 0.0, 0.0, &again);
  EXPECT_TRUE(blocked(again, 8.6)) << "the vehicle looks elsewhere";
  vj::Terrain seen = terrain_with_strip(50.0, 51.0);
  look(&hidden, aside, 0.0, 0.0, &seen);
  EXPECT_FALSE(blocked(seen, 8.6));
  vj::Terrain later = terrain_with_strip(8.0, 20.0);
  look(&hidden, aside, 0.0, 0.0, &later);
  EXPECT_FALSE(blocked(later, 8.6));
}

TEST(HiddenGround, WhatWasNotLookedAtIsNotHidden) {
  HiddenGround hidden(sight());
  vj::Terrain t = terrain_with_strip(8.0, 20.0);
  hidden.mark({}, 0.0, 0.0, true, &t);
  EXPECT_FALSE(blocked(t, 8.6)) << "one scan may be incomplete";
  for (int k = 0; k < 5; ++k) {  // the vehicle drives on without scans
    vj::Terrain old = terrain_with_strip(8.0, 20.0);
    hidden.mark({}, 0.0, 0.0, false, &old);
    EXPECT_FALSE(blocked(old, 8.6));
  }
}

TEST(HiddenGround, ASingleCellIsMissedByChance) {
  HiddenGround hidden(sight());
  vj::Terrain t = terrain_with_strip(50.0, 51.0);
  t.ground[t.index(t.cell_at(8.6, 0.0))].known = false;
  look(&hidden, {}, 0.0, 0.0, &t);
  EXPECT_FALSE(blocked(t, 8.6));
}

}  // namespace
}  // namespace rcs::bg

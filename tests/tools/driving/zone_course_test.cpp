// The zones that rcs drive draws, and their judge.

#include "tools/driving/zone_course.h"

#include <gtest/gtest.h>

#include <random>

#include "rcs/zones/zone_file.h"

namespace rcs::driving {
namespace {

std::vector<Vec2> course(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Vec2> places = {Vec2::Zero()};
  double heading = 0.0;
  for (int k = 0; k < 6; ++k) {
    heading += 1e-3 * static_cast<double>(random() % 1000) - 0.5;
    places.emplace_back(places.back() + 60.0 * Vec2(std::cos(heading), std::sin(heading)));
  }
  return places;
}

TEST(ZoneCourse, NoWaypointIsForbiddenAndEachLegButTheFirstHasAKeepOut) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    const std::vector<Vec2> places = course(seed);
    const std::vector<Zone> drawn = draw_zones(places, seed);
    ASSERT_EQ(drawn.size(), places.size() - 1);
    const Zones zones(drawn);
    for (const Vec2& p : places) EXPECT_GT(zones.clearance(p).m, 5.0) << seed;
  }
}

TEST(ZoneCourse, TheFileIsReadAsItWasDrawn) {
  const LocalFrame world({radians(40.43), radians(-76.57), {150.0}});
  const std::vector<Zone> drawn = draw_zones(course(3), 3);
  const Result<GeodeticZones> read = parse_zones(to_geojson(drawn, world), "drawn");
  ASSERT_TRUE(read) << read.error().message;
  const Zones again = read->in_world(world);
  const Zones zones(drawn);
  for (double x = -50.0; x < 400.0; x += 7.0) {
    for (double y = -100.0; y < 100.0; y += 7.0) {
      EXPECT_NEAR(again.clearance({x, y}).m, zones.clearance({x, y}).m, 0.02);
    }
  }
}

TEST(ZoneCourse, TheJudgeCountsEachEntryOfTheOutline) {
  const Zones zones(
      {{ZoneKind::kKeepOut,
        "box",
        0.0,
        {{{Vec2(10.0, -5.0), Vec2(20.0, -5.0), Vec2(20.0, 5.0), Vec2(10.0, 5.0)}, {}}}}});
  ZoneJudge judge(zones, bg::Shape());
  const auto at = [&judge](double x_m) { judge.note({Quat::Identity(), Vec3(x_m, 0.0, 0.0)}); };
  for (double x = 0.0; x < 8.0; x += 0.1) at(x);
  EXPECT_EQ(judge.outcome().entries, 0);
  EXPECT_LT(judge.outcome().min_clearance_m, 0.8) << "its front is 1.6 m ahead";
  for (double x = 8.0; x < 12.0; x += 0.1) at(x);
  EXPECT_EQ(judge.outcome().entries, 1);
  for (double x = 12.0; x > 5.0; x -= 0.1) at(x);
  for (double x = 5.0; x < 12.0; x += 0.1) at(x);
  EXPECT_EQ(judge.outcome().entries, 2);
}

}  // namespace
}  // namespace rcs::driving

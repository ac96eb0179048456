#include "modules/mission/bg_route.h"

#include <gtest/gtest.h>

namespace rcs::mission {
namespace {

BgRoute route_of(std::size_t n) {
  BgRoute route;
  route.begin(std::vector<RoutePlace>(n));
  return route;
}

// BG begins a command at its first place: it must not drive back to those that are done.
TEST(BgRoute, AfterAHaltItContinuesAtTheNextPlace) {
  BgRoute route = route_of(46);
  route.note(20);
  route.advance();  // less than half of the window
  EXPECT_EQ(route.first(), 0U);
  route.resume();
  EXPECT_EQ(route.first(), 20U);
  route.note(0);  // the halt had no places
  EXPECT_EQ(route.done(), 20U);
  route.note(3);
  EXPECT_EQ(route.done(), 23U);
  route.note(26);
  EXPECT_TRUE(route.arrived());
  route.resume();
  EXPECT_LT(route.first(), route.last()) << "a command without places is rejected";
}

TEST(BgRoute, TheWindowMovesOnceHalfOfItIsDone) {
  BgRoute route = route_of(100);
  route.note(23);
  route.advance();
  EXPECT_EQ(route.first(), 0U);
  route.note(24);
  route.advance();
  EXPECT_EQ(route.first(), 24U);
  EXPECT_EQ(route.last(), 72U);
}

TEST(BgRoute, PlacesBehindTheVehicleAreNoPartOfTheRestOfARoute) {
  const std::vector<Vec2> line = {{0.0, 0.0}, {100.0, 0.0}, {100.0, 100.0}};
  const std::vector<Vec2> places = divided(line, 25.0);
  ASSERT_EQ(places.size(), 8U);
  const auto first = [&](const Vec2& here, std::size_t last = 8) {
    return first_ahead(line.front(), places, last, here);
  };
  EXPECT_EQ(first({0.0, 0.0}), 0U);
  EXPECT_EQ(first({-20.0, 3.0}), 0U) << "the vehicle stands before the line";
  EXPECT_EQ(first({60.0, -4.0}), 2U);
  EXPECT_EQ(first({98.0, 60.0}), 6U);
  EXPECT_EQ(first({100.0, 140.0}), 7U) << "a route without places is rejected";
  EXPECT_EQ(first({98.0, 60.0}, 3), 3U) << "a waypoint of the task that is not done";
}

}  // namespace
}  // namespace rcs::mission

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

}  // namespace
}  // namespace rcs::mission
